"""Codes of refusals: messages and streams."""

from nondum.sdk.codes.code import Code

AREA = "Messages and streams"
CODES = (
    Code(
        "BRIDGE_DIED",
        "The process that carries streams to other hosts has ended; it is started again.",
        "see the daemon's log if it happens again",
    ),
    Code(
        "BRIDGE_PACKET",
        "Another host's bridge sent what the protocol does not allow.",
        "use the same version of nondum on both hosts",
    ),
    Code(
        "BRIDGE_START",
        "The process that carries streams to other hosts does not start.",
        "see the daemon's log; look whether its port is taken",
    ),
    Code(
        "BRIDGE_VERSION",
        "Another host's bridge speaks another version.",
        "use the same version of nondum on both hosts",
    ),
    Code(
        "CHUNK_FIELDS",
        "A piece of a long message is not what it must be.",
        "use the same version of nondum at both ends",
    ),
    Code(
        "INPUT_AMBIGUOUS",
        "Several streams fit an optional input of a component, and the host had to pick one.",
        "say which it is to be: `nondum streams --connect INPUT STREAM`",
    ),
    Code(
        "INPUT_STREAM",
        "That stream cannot feed that input: it has another type, or is the component's own.",
        "connect one of the streams that the message names",
    ),
    Code(
        "INPUT_UNKNOWN",
        "No running component has an optional input of that name.",
        "see `nondum streams --inputs`",
    ),
    Code(
        "JPEG_FAILED",
        "An image could not be made into a JPEG.",
        "show another stream; tell the plugin's author what image it sends",
    ),
    Code(
        "JPEG_INVALID",
        "Only images come as JPEG.",
        "show the stream without --jpeg",
    ),
    Code(
        "MESSAGE_BULK",
        "A fact cannot hold a message of that size.",
        "tell the plugin's author: send it as a stream",
    ),
    Code(
        "MESSAGE_FIELD",
        "A message lacks a field, has one too many, or one of another type or shape.",
        "tell the plugin's author: docs/messages.md lists the fields",
    ),
    Code(
        "MESSAGE_TOO_LONG",
        "A message is longer than may be sent.",
        "tell the plugin's author: send less at once, or as a stream",
    ),
    Code(
        "MESSAGE_TYPE",
        "There is no message type of that name, or another type is expected there.",
        "tell the plugin's author: use one of those in docs/messages.md, and the one declared",
    ),
    Code(
        "MESSAGE_VALUE",
        "A field of a message holds a value that cannot be.",
        "tell the plugin's author: docs/messages.md says what each field holds",
    ),
    Code(
        "PACKET_DESCRIPTORS",
        "A packet carries open files that the protocol does not allow there.",
        "tell the author of the program at the other end",
    ),
    Code(
        "PACKET_FIELDS",
        "A packet has other fields than its kind has.",
        "use the same version of nondum at both ends",
    ),
    Code(
        "PACKET_KIND",
        "A packet is of no known kind.",
        "use the same version of nondum at both ends",
    ),
    Code(
        "PACKET_MALFORMED",
        "A packet cannot be read.",
        "use the same version of nondum at both ends; else tell the author of the program at "
        "the other end",
    ),
    Code(
        "PACKET_TOO_DEEP",
        "A packet is nested too deeply.",
        "tell the author of the program at the other end",
    ),
    Code(
        "PACKET_TOO_LONG",
        "A packet is longer than may be sent.",
        "tell the author of the program at the other end",
    ),
    Code(
        "PACKET_VALUE",
        "A packet holds a number that is none.",
        "tell the author of the program at the other end",
    ),
    Code(
        "SLOT_HOLES",
        "Memory that is handed over is not there yet: its reader would have to provide it.",
        "tell the plugin's author; build the payload again with the nondum-sdk of the host",
    ),
    Code(
        "SLOT_LENGTH",
        "A frame is longer than the memory that it is in.",
        "tell the plugin's author",
    ),
    Code(
        "SLOT_SEALS",
        "Memory that is handed over could still be changed.",
        "build the payload again with the nondum-sdk that belongs to the host",
    ),
    Code(
        "SLOT_SIZE",
        "Memory that is handed over is empty or too big.",
        "tell the plugin's author",
    ),
    Code(
        "SLOT_UNKNOWN",
        "A message names memory that was never handed over.",
        "build the payload again with the nondum-sdk that belongs to the host",
    ),
    Code(
        "STREAM_ANSWER",
        "Another host's answer gives no stream.",
        "use the same version of nondum on both hosts",
    ),
    Code(
        "STREAM_ARGUMENTS",
        "Another host asks for a stream in a way that is not known.",
        "use the same version of nondum on both hosts",
    ),
    Code(
        "STREAM_ENDED",
        "A stream has ended: its source is gone.",
        "plug its source in again; it is connected by itself then",
    ),
    Code(
        "STREAM_HANDLE",
        "A stream was handed over without its connection.",
        "build the payload again with the nondum-sdk that belongs to the host",
    ),
    Code(
        "STREAM_LOST",
        "The connection that a stream came by has ended.",
        "look whether the other host is still there: `nondum peers`",
    ),
    Code(
        "STREAM_NOT_GRANTED",
        "Another host does not let this one read the stream.",
        "see `nondum peers` there for who is let in",
    ),
    Code(
        "STREAM_PACKET",
        "What came is no packet of a stream.",
        "use the same version of nondum on both hosts",
    ),
    Code(
        "STREAM_SILENT",
        "Nothing came on a stream for too long.",
        "look at its source: `nondum streams`, `nondum logs`",
    ),
    Code(
        "STREAM_TOO_MANY",
        "One host reads more streams of this one than it may.",
        "stop reading some of them",
    ),
    Code(
        "STREAM_TYPE",
        "A stream is of another type than its reader expects.",
        "choose another source with `nondum streams`, or tell the plugin's author",
    ),
    Code(
        "STREAM_UNCLAIMED",
        "A host asked for a stream, and then did not connect to it in time.",
        "ask again; look at the network between the hosts",
    ),
    Code(
        "STREAM_UNKNOWN",
        "There is no such stream.",
        "see `nondum streams` for those that are here",
    ),
    Code(
        "STREAM_UNREACHABLE",
        "The other host cannot be reached for its stream.",
        "look at the network and at firewalls between the hosts: `nondum doctor network`",
    ),
)
