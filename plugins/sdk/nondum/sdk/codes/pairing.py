"""Codes of refusals: pairing, keys and certificates of hosts."""

from nondum.sdk.codes.code import Code

AREA = "Pairing, keys and certificates of hosts"
CODES = (
    Code(
        "CERTIFICATE_FLEET",
        "The certificate is signed by a fleet that this host does not belong to.",
        "have the host's certificate issued by this fleet, or pair the two hosts",
    ),
    Code(
        "CERTIFICATE_KEY",
        "The certificate is another host's.",
        "have one signed for what `nondum peers key` prints",
    ),
    Code(
        "CERTIFICATE_MALFORMED",
        "A certificate cannot be read.",
        "have it issued and copied again",
    ),
    Code(
        "CERTIFICATE_NAME",
        "The certificate calls this host by another name.",
        "have it signed again, or change `name` under [host]",
    ),
    Code(
        "CERTIFICATE_SIGNATURE",
        "The fleet did not sign this certificate.",
        "have it issued by the fleet's key: `nondum keys --help`",
    ),
    Code(
        "CERTIFICATE_TIME",
        "The certificate does not hold now.",
        "look at this host's clock, then have the certificate issued again",
    ),
    Code(
        "CERTIFICATE_VALIDITY",
        "The certificate would end before it begins.",
        "give an end that is later than its beginning",
    ),
    Code(
        "FILE_MALFORMED",
        "A file of keys is not as such files are.",
        "see `nondum peers key --help` and `nondum keys fleet new --help`",
    ),
    Code(
        "FILE_OPEN_TO_OTHERS",
        "Other users could read or change a secret key, so it proves nothing any more.",
        "make a new key, or, if no one else has used this machine, `chmod 600` it",
    ),
    Code(
        "FLEET_EXISTS",
        "There is a fleet's key already.",
        "choose another folder; whatever the old one signed would be worth nothing",
    ),
    Code(
        "FLEET_NAME",
        "A fleet's name is not one that is allowed.",
        "use letters, digits, - and _",
    ),
    Code(
        "FLEET_UNTRUSTED",
        "Hosts of that fleet let this one in, but not the other way round.",
        "nondum peers trust-fleet FILE",
    ),
    Code(
        "KEY_OWN",
        "This is the host's own key.",
        "revoke it on the other hosts, and delete the file to have a new one made",
    ),
    Code(
        "KEY_REVOKED",
        "This key was revoked.",
        "give the host a new key, and pair it or have its certificate issued again",
    ),
    Code(
        "KEY_UNKNOWN",
        "This host neither paired with the key nor knows a certificate of it.",
        "pair the two hosts, or put a certificate of the fleet on the other one",
    ),
    Code(
        "PAIRING_BROKEN",
        "The other end does not pair as nondum does.",
        "begin again; if it breaks again, run the same version of nondum on both hosts",
    ),
    Code(
        "PAIRING_BUSY",
        "The other host is being paired with another one.",
        "wait until that is done, and begin again",
    ),
    Code(
        "PAIRING_CODE",
        "This is not the code that is shown here.",
        "look at the other screen again; if both hosts show different codes, say no: "
        "somebody is between them",
    ),
    Code(
        "PAIRING_COMMITMENT",
        "The other end changed what it had promised.",
        "begin again over a network that you trust: somebody may be between the two hosts",
    ),
    Code(
        "PAIRING_DEVELOPMENT",
        "A host without keys has nothing to be paired by.",
        "set `development = false` under [peers]",
    ),
    Code(
        "PAIRING_KEY",
        "Another host speaks than the one that began.",
        "begin again over a network that you trust",
    ),
    Code(
        "PAIRING_NAME",
        "The two hosts have one name, or one of them knows another host of the other's name.",
        "give one of them another name, `name` under [host], start it again, and pair them then",
    ),
    Code(
        "PAIRING_OPEN",
        "Somebody is pairing this host already.",
        "confirm there, or with `nondum peers pair --yes-code CODE`",
    ),
    Code(
        "PAIRING_ORDER",
        "Pairing went out of turn.",
        "begin again with `nondum peers pair` on both hosts",
    ),
    Code(
        "PAIRING_OVER",
        "The time for pairing is over.",
        "run `nondum peers pair` on both hosts at the same time, on one network",
    ),
    Code(
        "PAIRING_PROOF",
        "The other end agreed to something else.",
        "begin again over a network that you trust: somebody may be between the two hosts",
    ),
    Code(
        "PAIRING_REFUSED",
        "Somebody said no.",
        "begin again, if that was a mistake",
    ),
    Code(
        "PAIRING_TRIES",
        "Too many attempts have failed: somebody may be between the two hosts.",
        "begin again on both hosts, over a network that you trust",
    ),
    Code(
        "PAIRING_UNWANTED",
        "The other host waits for another one, or has revoked this one.",
        "look at `nondum peers trust` there",
    ),
    Code(
        "PAIRING_VANISHED",
        "The other host went away while it was being paired.",
        "look whether it is on, and begin again",
    ),
)
