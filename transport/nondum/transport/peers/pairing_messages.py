"""What two hosts say while they are being paired, as bytes: pure, and as strict as `messages`.

One msgpack list a message, its kind first. Whatever a stranger sends, `decode` gives a value, or
raises.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeAlias

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.wire import pack, unpack
from nondum.transport.peers.certificate import HOST_NAME
from nondum.transport.peers.keys import parse_key
from nondum.transport.peers.pairing import NONCE_BYTES, Agreed, Ask, Commit, Message, Nonce

MAX_BYTES = 512
"""In one message; the longest is a commit: key, name and hash."""
HASH_BYTES = 32


class Ending(Enum):
    """Why an end has given up a try; all that it says, so that no stranger's words are shown."""

    REFUSED = "refused"
    """Its person said no."""
    BUSY = "busy"
    """It is in another try."""
    UNWANTED = "unwanted"
    """It waits for another host, or has revoked this one's key."""
    NAME = "name"
    """It has the same name, or knows another host of that name."""
    TRIES = "tries"
    OVER = "over"
    """Its person has closed the window, or the time has."""
    BROKEN = "broken"
    """It was told what does not belong there, or nothing."""


@dataclass(frozen=True, slots=True)
class Ended:
    """The try is over for the end that says so."""

    why: Ending


@dataclass(frozen=True, slots=True)
class Beat:
    """Nothing: it is sent to learn whether the connection is still there."""


Said: TypeAlias = Message | Ended | Beat


def encode(said: Said) -> bytes:
    """Make the bytes of a message."""
    match said:
        case Ask(key, name):
            fields: tuple[Any, ...] = (0, key, name)
        case Commit(key, name, commitment):
            fields = (1, key, name, commitment)
        case Nonce(nonce):
            fields = (2, nonce)
        case Agreed(proof):
            fields = (3, proof)
        case Ended(why):
            fields = (4, why.value)
        case Beat():
            fields = (5,)
    return pack(fields, MAX_BYTES)


def decode(data: bytes | memoryview) -> Said:
    """Read a message.

    Raises `ProtocolViolation` (PACKET_…, HOST_NAME) or `PeerRefused` (KEY_MALFORMED) for anything
    that is not one exact message.
    """
    fields = unpack(data, MAX_BYTES)
    if not isinstance(fields, list) or not fields or type(fields[0]) is not int:
        raise _violation("PACKET_KIND", "a message is a list that begins with its kind")
    if not 0 <= fields[0] < len(_READERS):
        raise _violation("PACKET_KIND", f"no kind of message has the number {fields[0]}")
    length, read = _READERS[fields[0]]
    if len(fields) != length:
        raise _violation(
            "PACKET_FIELDS", f"kind {fields[0]} has {length} fields, found {len(fields)}"
        )
    return read(fields)


def _read_ending(fields: list[Any]) -> Ended:
    known = {ending.value: ending for ending in Ending}
    if type(fields[1]) is not str or fields[1] not in known:
        raise _violation("PACKET_FIELDS", "a try ends for one of a few reasons")
    return Ended(known[fields[1]])


def _text(value: object) -> str:
    if type(value) is not str:
        raise _violation("PACKET_FIELDS", f"expected a text, found {type(value).__name__}")
    return value


def _name(value: object) -> str:
    text = _text(value)
    if not HOST_NAME.fullmatch(text):
        raise _violation("HOST_NAME", "the other end's name is none of a host")
    return text


def _bytes(value: object, length: int) -> bytes:
    if type(value) is not bytes or len(value) != length:
        raise _violation("PACKET_FIELDS", f"expected {length} bytes")
    return value


_READERS: tuple[tuple[int, Callable[[list[Any]], Said]], ...] = (
    (3, lambda fields: Ask(parse_key(_text(fields[1])), _name(fields[2]))),
    (
        4,
        lambda fields: Commit(
            parse_key(_text(fields[1])), _name(fields[2]), _bytes(fields[3], HASH_BYTES)
        ),
    ),
    (2, lambda fields: Nonce(_bytes(fields[1], NONCE_BYTES))),
    (2, lambda fields: Agreed(_bytes(fields[1], HASH_BYTES))),
    (2, _read_ending),
    (1, lambda fields: Beat()),
)
"""By kind: how many fields a message has, and how they are read."""


def _violation(code: str, message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem(code, message))
