"""Codes of refusals: hosts among each other."""

from nondum.sdk.codes.code import Code

AREA = "Hosts among each other"
CODES = (
    Code(
        "ADDRESS_MALFORMED",
        "An address is not written as addresses are.",
        "write tcp://HOST:PORT; an endpoint of a router is PROTOCOL/HOST:PORT, for example "
        "tls/10.0.0.1:7447",
    ),
    Code(
        "ADDRESS_UNUSABLE",
        "This host cannot listen at that address.",
        "end the program that has the port, or set another one in `peers.listen`",
    ),
    Code(
        "ANSWER_FORGOTTEN",
        "A call was carried out, or begun, but its answer is kept no more.",
        "look at what it did before you ask again",
    ),
    Code(
        "ANSWER_UNSENDABLE",
        "An answer cannot be sent to another host.",
        "see the daemon's log; use the same version of nondum on both hosts",
    ),
    Code(
        "ASKING_UNUSABLE",
        "Hosts that ask by UDP cannot be answered.",
        "end the program that has the port, or set another one in `peers.listen`",
    ),
    Code(
        "CALL_MALFORMED",
        "Another host calls in a way that is not known.",
        "use the same version of nondum on both hosts",
    ),
    Code(
        "CATALOGUE_TOO_LONG",
        "This host has more to tell than others would take.",
        "pull payloads that are not needed",
    ),
    Code(
        "DEVELOPMENT_LOOPBACK",
        "Without keys, other hosts may be on this machine only.",
        "use 127.0.0.1, or give the host keys",
    ),
    Code(
        "DIAL_IMPOSSIBLE",
        "This host has nothing left to make a connection with.",
        "raise the limit of open files, or end programs that have many open: it is tried again",
    ),
    Code(
        "ENTRY_KEY",
        "The key of something that is shared is too long, or empty.",
        "tell the plugin's author: use shorter names",
    ),
    Code(
        "ENTRY_TOO_LONG",
        "One thing that is shared is longer than a message may be.",
        "split what it tells into several",
    ),
    Code(
        "FLEET_AMBIGUOUS",
        "More than one extension of the host would reach its peers as its configuration says.",
        "uninstall all of them but one",
    ),
    Code(
        "GOALS_NOT_TAKEN",
        "The other host takes no goals from others.",
        "its integrator says so: `accept_goals` under [peers]",
    ),
    Code(
        "HINT_CROWDED",
        "More hosts are announced than are remembered.",
        "look which machine announces that many; name the hosts that matter in `peers.static`",
    ),
    Code(
        "HINT_MALFORMED",
        "What another host announces cannot be read.",
        "use the same version of nondum on both hosts; else look who announces it",
    ),
    Code(
        "HINT_NAME",
        "What is announced is not called after its key.",
        "look who announces it: it may be an attempt to be taken for another host",
    ),
    Code(
        "HINT_NOWHERE",
        "What is announced has no address near here.",
        "look at the network settings of the other host",
    ),
    Code(
        "HINT_SECURITY",
        "One of the two hosts has no keys.",
        "give both hosts keys, or none: `development` under [peers]",
    ),
    Code(
        "HOST_NAME",
        "A host's name is not one that is allowed.",
        "use up to 63 of a-z, 0-9 and -, with no - at the ends",
    ),
    Code(
        "IDENTITY_DUPLICATE",
        "Another host has this host's key.",
        "one of the two is a copy: delete the key file there, and start that host again",
    ),
    Code(
        "LINKS_DIED",
        "The process that holds the links to other hosts (`process` under [peers]) has ended, for "
        "want of memory or else. It is started again, and the links come back.",
        "if it happens again, see the daemon's log and `nondum peers --why`: a host may send far "
        "too much",
    ),
    Code(
        "LINKS_START",
        "The process that is to hold the links to other hosts does not start.",
        "see the daemon's log; or set `process = false` under [peers]",
    ),
    Code(
        "METHOD_UNKNOWN",
        "This host does not know the call.",
        "run the same version of nondum on both hosts",
    ),
    Code(
        "MULTICAST_MEMBERSHIPS",
        "The system limits on how many interfaces one program may listen, and this host has more.",
        "raise net.ipv4.igmp_max_memberships with sysctl, as the message says",
    ),
    Code(
        "MULTICAST_NOT_JOINED",
        "Other hosts cannot be looked for there, as yet.",
        "nothing, if it was plugged in just now; else look with `nondum doctor network`",
    ),
    Code(
        "MULTICAST_UNUSABLE",
        "Other hosts cannot be looked for by multicast.",
        "look which programs have UDP port 5353; hosts in `peers.static` are asked still",
    ),
    Code(
        "NOT_OFFERED",
        "This host does not offer that to others.",
        "its integrator says what is offered: `offer_actuators` and the others under [peers]",
    ),
    Code(
        "PEERS_FOLDER",
        "The list of the hosts that this one trusts cannot be saved.",
        "look at the disk, and at `state` under [host]",
    ),
    Code(
        "PEERS_OFF",
        "This host has nothing to do with others.",
        "set `enabled = true` under [peers]",
    ),
    Code(
        "PEER_AMBIGUOUS",
        "Several hosts have that name.",
        "say which by its fingerprint",
    ),
    Code(
        "PEER_BUSY",
        "The other host has more to do than it takes.",
        "try again in a while",
    ),
    Code(
        "PEER_DOWN",
        "There is no link to the other host.",
        "look whether it is on, and at the network: `nondum peers`, `nondum doctor network`",
    ),
    Code(
        "PEER_DUPLICATE",
        "Two hosts share one key, or an old connection came late.",
        "give the copied host new keys, if there are two",
    ),
    Code(
        "PEER_ENDLESS",
        "Another host sends a message that does not end, and is not let in for a while.",
        "look what runs on that host; if it was taken over, `nondum peers revoke`",
    ),
    Code(
        "PEER_ENTRY",
        "Another host shares what cannot be understood.",
        "use the same version of nondum on both hosts",
    ),
    Code(
        "PEER_FLOODS",
        "Another host sends more than any host needs to, and is not let in for a while.",
        "look for what it runs that calls or tells others without end",
    ),
    Code(
        "PEER_LOST",
        "The other host was lost while it was needed.",
        "look whether it is on, and at the network: `nondum peers`",
    ),
    Code(
        "PEER_MISMATCH",
        "The other host is not the one that was announced, or has no keys.",
        "compare the fingerprints on both hosts, and `security` in `nondum peers`",
    ),
    Code(
        "PEER_NAME_TAKEN",
        "Two hosts have one name; the second is not let in.",
        "give one of the hosts another name",
    ),
    Code(
        "PEER_NOT_PROVED",
        "The other host claims a key that it has not proved to have.",
        "look who is at that address: it may be an attempt to be taken for another host",
    ),
    Code(
        "PEER_SILENT",
        "No host answers there.",
        "look whether the other host is on, and at firewalls between",
    ),
    Code(
        "PEER_STRANGER",
        "A host that this one does not know wants to link.",
        "pair the two hosts if you know it: `nondum peers pair`",
    ),
    Code(
        "PEER_TURNED_AWAY",
        "The other host does not let this one in.",
        "pair the two hosts, or look at the revoked keys of the other one",
    ),
    Code(
        "PEER_UNKNOWN",
        "No host is known by that name.",
        "see `nondum peers`; a host that is not here can be named by its whole key",
    ),
    Code(
        "PLACED_ELSEWHERE",
        "The payload is to run on another host.",
        "have it run here again with `nondum place … --here`",
    ),
    Code(
        "PLACE_CLOSED",
        "The other host does not take payloads now.",
        "try again, or choose another host with `nondum place`",
    ),
    Code(
        "PLACE_ENDED",
        "The payload does not run on the other host any more.",
        "see `nondum place` for why; it is placed again by itself where that is possible",
    ),
    Code(
        "PLACE_FIXED",
        "The payload cannot be moved from here.",
        "plug a drive with it into this host, or place it from the host that placed it",
    ),
    Code(
        "PLACE_FULL",
        "This host has as many payloads of others as it takes.",
        "choose another host, or withdraw one with `nondum place … --here`",
    ),
    Code(
        "PLACE_OFF",
        "The other host takes no payloads from others.",
        "its integrator says so: `accept_payloads` under [peers]",
    ),
    Code(
        "PROTO_VERSION",
        "The two ends speak no version of the protocol that both know.",
        "update the older of the two",
    ),
    Code(
        "ROUTER_UNREACHED",
        "The router of the fleet cannot be reached.",
        "look whether it runs, and at `endpoints` under [router]",
    ),
    Code(
        "STATIC_HOST",
        "An entry of `peers.static` is no host.",
        "write for example `lab-3.local` or `10.0.0.7:7410`",
    ),
    Code(
        "STATIC_SILENT",
        "No host answers at an address of `peers.static`.",
        "look whether nondum runs there, and whether its UDP and TCP ports are open",
    ),
    Code(
        "STATIC_UNKNOWN",
        "A host of `peers.static` cannot be found.",
        "look at its spelling, or write the address instead of the name",
    ),
    Code(
        "ZAP_INEFFECTIVE",
        "Keys that must be turned away were let in, so this host does not listen.",
        "look for another ZeroMQ authenticator in this process, and restart nondum",
    ),
    Code(
        "ZAP_TAKEN",
        "Something else decides who may link to this process.",
        "look for another ZeroMQ authenticator in this process, and restart nondum",
    ),
    Code(
        "ZENOH_MISSING",
        "Fleets over a Zenoh router need an extension of the host, and the package eclipse-zenoh.",
        "pip install 'nondum[zenoh]'",
    ),
)
