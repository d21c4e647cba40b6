"""What two bridges say to each other over the connection of one stream: values and their parts.

Pure: whatever a hostile bridge sends, `read_asked` and `read_told` give a value or raise
`ProtocolViolation`. A message has one part, and a frame one more for each piece of its bulk bytes:
while one piece is sealed, the one before is on its way, and the one before that is opened.

    reader → owner   [1, version, token]              a grant is claimed: the first message
                     [2, seq]                         a frame has been handled
                     [3, at_s]                        a sign of life
    owner → reader   [1, type]                        the claim holds: frames follow
                     [2, seq, coding, header], piece … a frame
                     [3, at_s, clock_s]               a sign of life, and the owner's clock
                     [4, problem]                     the stream is over
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any, TypeAlias

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.sdk.messages import Buffer
from nondum.sdk.wire import Body, pack, unpack
from nondum.sdk.wire_fields import Name, Number, read_field, read_problem

VERSION = 2
MAX_ASKED = 1024
"""Bytes of a reader's message."""
PINGS_HZ = 20.0
"""Signs of life that each end bears for long; more end the connection."""
MAX_BULK = 64 * 1024 * 1024
"""Bulk bytes of one frame; longer ones stay on their host."""
PIECE = 128 * 1024
"""Bulk bytes of all pieces but the last one."""


class Coding(Enum):
    """How a frame's bulk bytes travel."""

    RAW = 0
    """As they are."""
    JPEG = 1
    """An image as JPEG; the header tells what it was, and is to be again."""


@frozen
class Claim:
    """The reader has been granted a stream."""

    version: int
    token: str


@frozen
class Handled:
    """A frame was taken in: another one may be sent."""

    seq: int


@frozen
class Ping:
    """A sign of life of the reader."""

    at_s: float
    """On the reader's clock."""


@frozen
class Opened:
    """The claim holds."""

    kind: str
    """The stream's type."""


@frozen
class Frame:
    """A message of the stream."""

    seq: int
    coding: Coding
    header: Mapping[str, Any]
    pieces: tuple[Buffer, ...] = ()
    """Its bulk bytes; none if the type has no such."""


@frozen
class Pong:
    """The answer to a ping."""

    at_s: float
    """As the ping had it."""
    clock_s: float
    """The owner's clock, when it answered."""


@frozen
class Over:
    """The stream has ended, or was never to be had."""

    problem: Problem


Asked: TypeAlias = Claim | Handled | Ping
Told: TypeAlias = Opened | Frame | Pong | Over


def asked(message: Asked) -> bytes:
    """The one part of a reader's message."""
    match message:
        case Claim(version, token):
            return pack([1, version, token])
        case Handled(seq):
            return pack([2, seq])
        case Ping(at_s):
            return pack([3, at_s])


def read_asked(data: bytes) -> Asked:
    """Read a reader's message. Raises `ProtocolViolation`."""
    match unpack(data, MAX_ASKED):
        case [1, int(version), token]:
            return Claim(read_field(Number, version), read_field(Name, token))
        case [2, seq]:
            return Handled(read_field(Number, seq))
        case [3, at_s]:
            return Ping(_clock(at_s))
    raise _violation("no message of a reader")


def told(message: Opened | Pong | Over) -> bytes:
    """The one part of an owner's message that is no frame."""
    match message:
        case Opened(kind):
            return pack([1, kind])
        case Pong(at_s, clock_s):
            return pack([3, at_s, clock_s])
        case Over(problem):
            return pack([4, problem.to_dict()])


def head(frame: Frame) -> bytes:
    """A frame's first part; its pieces follow.

    Raises `ProtocolViolation` for a header that fits no packet.
    """
    return pack([2, frame.seq, frame.coding.value, frame.header])


def cut(bulk: Buffer) -> tuple[memoryview, ...]:
    """The pieces of bulk bytes: at least one."""
    data = memoryview(bulk).cast("B")
    return tuple(data[at : at + PIECE] for at in range(0, data.nbytes or 1, PIECE))


def read_told(parts: Sequence[Buffer]) -> Told:
    """Read an owner's message; a frame's pieces stay where they are. Raises `ProtocolViolation`."""
    if not parts:
        raise _violation("a message has one part at least")
    pieces = tuple(parts[1:])
    fields = unpack(bytes(parts[0]))
    match fields:
        case [2, seq, 0 | 1 as coding, header] if type(coding) is int and _are_cut(pieces):
            return Frame(read_field(Number, seq), Coding(coding), read_field(Body, header), pieces)
        case [1, kind] if not pieces:
            return Opened(read_field(Name, kind))
        case [3, at_s, clock_s] if not pieces:
            return Pong(_clock(at_s), _clock(clock_s))
        case [4, problem] if not pieces:
            return Over(read_problem(problem))
    raise _violation("no message of a stream's owner")


def _are_cut(pieces: Sequence[Buffer]) -> bool:
    """Whether they are as `cut` makes them, and no more than may be."""
    *others, last = pieces or (b"",)
    return len(last) <= min(PIECE, MAX_BULK - len(others) * PIECE) and all(
        len(piece) == PIECE for piece in others
    )


def _clock(value: object) -> float:
    if type(value) is not float:  # `unpack` refuses those that are not finite
        raise _violation("a clock is a finite number of seconds")
    return value


def _violation(message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem("BRIDGE_PACKET", message))
