"""What peers say to each other: one msgpack list per message, its kind first, with strict limits.

Pure: values in, bytes out, and back. Whatever a hostile peer sends, `decode` gives a `Message` or
raises `ProtocolViolation`. The first two kinds never change, so that any two versions can agree on
a version, or part with a reason.
"""

from __future__ import annotations

import math
from typing import Annotated, TypeAlias, get_args

from nondum.sdk.codec.checks import Bounds
from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.sdk.packet_codec import FLAT, PacketCodec
from nondum.sdk.wire import Body, pack, unpack
from nondum.sdk.wire_fields import MAX_ID, Name, Number
from nondum.transport.peers.pulse import State

VERSIONS: tuple[int, ...] = (2, 1)
"""Versions of this protocol that this host speaks, newest first. 2 adds `Ask` and `Vouch`."""
MAX_MESSAGE = 128 * 1024
"""Bytes in a message."""
MAX_CERTIFICATE = 1024


@frozen
class Hello:
    """The first message of the host that dialled, and, as `Welcome`, the answer to it."""

    versions: Annotated[tuple[Number, ...], Bounds(1, 16)]
    name: Name
    key: Name
    """The sender's public key; the link must prove the same one."""
    epoch: Number
    """Drawn at random when the sender started."""
    term: Number
    """How often the sender has given up links to this peer in this epoch, plus one."""
    certificate: Annotated[bytes, Bounds(0, MAX_CERTIFICATE)]
    """Empty for none."""


def _check_version(hello: Hello) -> None:
    Bounds(1, 1)(hello.versions)  # the one to speak


@frozen
class Welcome:
    """The answer to a hello: the same of the other end, with the one version to speak."""

    hello: Annotated[Hello, FLAT, _check_version]


@frozen
class Refused:
    """The last message before a link is cut: why."""

    problem: Problem


@frozen
class Request:
    """A call; answered once, by `Reply` or `Failure` with the same number."""

    number: Number
    settled: Number
    """The caller has the answers of all its calls below this number."""
    remaining_ms: Number
    """How long the caller will still wait: clocks differ, so never a time of day."""
    method: Name
    args: Body


@frozen
class Reply:
    """A call was carried out."""

    number: Number
    body: Body


@frozen
class Failure:
    """A call failed, or was halted."""

    number: Number
    problems: Annotated[tuple[Problem, ...], Bounds(1, 64)]


@frozen
class Progress:
    """How far a call is; may be lost."""

    number: Number
    body: Body


@frozen
class Cancel:
    """Halt a call; it is still answered."""

    number: Number


@frozen
class Notice:
    """Something worth knowing; not answered, and never repeated."""

    method: Name
    args: Body


@frozen
class Ping:
    """The sender's loop is working."""

    number: Number
    beat_ms: Number = 300
    """Until the next one."""
    state: Annotated[State | None, FLAT] = None
    """How far the sender's account of itself is; two more fields, or none."""


@frozen
class Pong:
    """A ping came; not every one is answered."""

    number: Number


@frozen
class Bye:
    """The sender is going, and means to."""

    reason: Name


@frozen
class Ask:
    """Whether a host answers that the sender does not hear (SWIM's ping-req)."""

    number: Number
    key: Name
    """Of the host in question."""


@frozen
class Vouch:
    """The host that was asked about has answered the sender; nothing is said when it has not."""

    number: Number


Message: TypeAlias = (
    Hello
    | Welcome
    | Refused
    | Request
    | Reply
    | Failure
    | Progress
    | Cancel
    | Notice
    | Ping
    | Pong
    | Bye
    | Ask
    | Vouch
)
"""The number of a kind on the wire is its place here."""


_PACKETS: PacketCodec[Message] = PacketCodec(get_args(Message))


def encode(message: Message) -> bytes:
    """Make the bytes of a message.

    Raises `ProtocolViolation` for what the other end would refuse (too long, too deep, NaN) and
    `TypeError` for values that are no plain data.
    """
    return pack(_PACKETS.fields(message), MAX_MESSAGE)


def decode(data: bytes | memoryview) -> Message:
    """Read a message. Raises `ProtocolViolation` for anything that is not one exact message."""
    return _PACKETS.message(unpack(data, MAX_MESSAGE))


def agreed_version(hello: Hello, here: str) -> int:
    """The newest version that both ends speak; `here` is this host's name.

    >>> agreed_version(Hello((3, 2, 1), "rover", "", 1, 1, b""), "base")
    2

    Raises `ProtocolViolation` (PROTO_VERSION), which says which of the two is older.
    """
    common = set(hello.versions) & set(VERSIONS)
    if not common:
        older = hello.name if max(hello.versions) < max(VERSIONS) else here
        raise ProtocolViolation(
            Problem(
                "PROTO_VERSION",
                f"{hello.name} speaks no version of the protocol that {here} speaks",
                where=hello.name,
                need=" or ".join(map(str, VERSIONS)),
                have=", ".join(map(str, hello.versions)),
                fix=f"update nondum on {older}",
            )
        )
    return max(common)


def milliseconds(seconds: float) -> int:
    """A duration for the wire: whole, at least one, at most what a number may be.

    >>> milliseconds(0.25), milliseconds(-3), milliseconds(float("inf"))
    (250, 1, 9007199254740992)
    """
    return MAX_ID if math.isinf(seconds) else min(MAX_ID, max(1, round(seconds * 1000)))
