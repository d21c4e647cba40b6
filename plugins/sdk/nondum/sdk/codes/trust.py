"""Codes of refusals: signatures and trust."""

from nondum.sdk.codes.code import Code

AREA = "Signatures and trust"
CODES = (
    Code(
        "CLOCK_UNSURE",
        "The clock is wrong, so the last date that is sure is judged by.",
        "set the host's clock, or let it reach a time server",
    ),
    Code(
        "ID_NOT_ALLOWED",
        "The role of this key may not bring payloads of this id.",
        "add the id to a role of that key in the trust file, or have it signed by another key",
    ),
    Code(
        "ID_OWNED_BY",
        "Payloads of this id belong to somebody else's keys.",
        "have it signed by the owner of the id, or build it under another id",
    ),
    Code(
        "KEY_EXISTS",
        "There is a key of that name already.",
        "choose another name, or use the one that is there",
    ),
    Code(
        "KEY_MALFORMED",
        "What is given is no key that can be used here.",
        "give a line or a file like those that `nondum keys new` and `nondum peers key` make",
    ),
    Code(
        "LIMIT_NOT_GRANTED",
        "A component asks for more memory, threads or time than its signer or this host may give.",
        "ask for less in payload.toml, or raise the bound: `most` of the role in the trust file, "
        "`most_…` under [workers] of the host",
    ),
    Code(
        "PERMISSION_DENIED",
        "The payload asks for more permissions than its signer may give.",
        "leave the permission out of payload.toml, or add it to that role in the trust file",
    ),
    Code(
        "RELEASE_CONFLICT",
        "Two different payloads claim to be the same release.",
        "find out which is genuine; give a changed payload a higher release",
    ),
    Code(
        "RELEASE_JUMP",
        "The release number is implausibly far ahead.",
        "have it built again with a plausible --release",
        causes=("a number that was typed wrongly; an attempt to shut out every later release"),
    ),
    Code(
        "ROLLBACK",
        "The payload is older than one that was active here before.",
        "plug in the newer release; to go back on purpose: `nondum payload rollback`",
    ),
    Code(
        "SIG_EXPIRED",
        "The key that signed the payload does not hold any more.",
        "ask for a payload signed with a current key, or have the key's time extended in "
        "the trust file; look at the host's clock too",
    ),
    Code(
        "SIG_INVALID",
        "The signature does not fit the contents list.",
        "the list was changed after it was signed: get the payload again, or sign it again",
        causes=("somebody has changed the payload; it was built again and not signed again"),
    ),
    Code(
        "SIG_MALFORMED",
        "The signature file cannot be read.",
        "sign the payload again: `nondum payload sign DIR --key KEY`",
        causes=("the file was cut off or changed; it is of another kind"),
    ),
    Code(
        "SIG_MISSING",
        "The payload is not signed, and this host takes no unsigned ones.",
        "have it signed by a key that this host trusts: `nondum payload sign DIR --key "
        "KEY`; for development only, set `allow_unsigned` under [drives]",
    ),
    Code(
        "SIG_NOT_YET",
        "The key that signed the payload does not hold yet.",
        "look at the host's clock; else wait, or ask for a payload that is signed with another key",
    ),
    Code(
        "SIG_REVOKED",
        "The payload is signed by a key that was revoked.",
        "ask for a payload that is signed with another key",
    ),
    Code(
        "SIG_TOO_FEW",
        "Fewer keys have signed the payload than its role demands.",
        "have the others sign it too: `nondum payload sign DIR --key KEY`",
    ),
    Code(
        "SIG_UNTRUSTED",
        "The payload is signed by a key that this host does not know.",
        "look whose key it is by its fingerprint; if it is to be trusted, add it to the "
        "trust file (`nondum keys trust`), else get another payload",
    ),
    Code(
        "SIG_WRONG_PURPOSE",
        "The signature was made for something other than a payload.",
        "sign it as a payload: `nondum payload sign DIR --key KEY`",
    ),
    Code(
        "SSH_KEYGEN",
        "ssh-keygen is missing, or refuses to do what it is asked.",
        "install openssh-client; else read the line that it said",
    ),
    Code(
        "TRUST_CONFLICT",
        "There are two different trust files of one version, both signed.",
        "find out which is genuine before any is used: a root key may be stolen",
    ),
    Code(
        "TRUST_ELSEWHERE",
        "The host that answers reads its first trust file at another place than the configuration "
        "says.",
        "name the configuration that it runs with: `nondum keys trust --config FILE`, or `--user`",
    ),
    Code(
        "TRUST_KEY",
        "The trust file has an unknown key, or lacks one.",
        "correct the key that is named; docs/trust.md lists them",
    ),
    Code(
        "TRUST_MISSING",
        "There is no trust file.",
        "enrol this host: docs/trust.md says how, for each kind of site",
    ),
    Code(
        "TRUST_OPEN_TO_OTHERS",
        "Others can change the trust file, or a folder that leads to it, so it does not say which "
        "keys to trust.",
        "put the genuine file there, then `chown root` and `chmod go-w` it and its folders",
    ),
    Code(
        "TRUST_OWNER",
        "The trust file is another owner's.",
        "use the one of this robot's owner; to change the owner, enrol the host again",
    ),
    Code(
        "TRUST_SIGNATURE",
        "Too few of its owner's root keys have signed the trust file, or it was changed since.",
        "have the trust file signed by as many root keys as the present one demands; a first one "
        "by as many of its root keys as it demands",
    ),
    Code(
        "TRUST_TOML",
        "The trust file is not TOML.",
        "correct the line that is named; see https://toml.io",
    ),
    Code(
        "TRUST_TWICE",
        "Two parts of the trust file have one name.",
        "give one of them another name",
    ),
    Code(
        "TRUST_UNANCHORED",
        "There is a trust file on a drive, and this host trusts no root key yet to check it with.",
        "compare the fingerprints of its roots with its owner's, then `nondum keys trust FILE`",
    ),
    Code(
        "TRUST_VALUE",
        "A value in the trust file is not what may stand there.",
        "correct the value that is named; docs/trust.md says what may stand there",
    ),
    Code(
        "TRUST_VERSION",
        "The trust file does not follow the active one.",
        "bring the versions in between, one after the other",
    ),
    Code(
        "WRONG_TARGET",
        "The payload is meant for other robots.",
        "get one that was built for this fleet, or for any (`--fleet`)",
    ),
    Code(
        "KEY_NOT_ROOT",
        "The key is none of the roots of the trust file.",
        "sign with a root's key; roots are changed by `nondum keys rotate`",
    ),
    Code(
        "KEY_TAKEN",
        "Two keys, or two roles, would have one name.",
        "choose another name",
    ),
    Code(
        "ROOTS_TOO_FEW",
        "Too few root keys would be left to sign the next trust file.",
        "add another root key first, or lower how many must sign",
    ),
    Code(
        "TRUST_EXISTS",
        "There is a trust file already.",
        "change the one that is there, or choose another folder",
    ),
)
