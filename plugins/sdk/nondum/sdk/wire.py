"""The envelope of a worker link: one msgpack message per packet, with strict limits.

Pure: values in, bytes out, and back. Whatever a hostile peer sends, `decode` gives a `WireMessage`
or raises `ProtocolViolation`, and never makes more memory of a packet than its length warrants.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, TypeAlias, get_args

import msgpack

from nondum.sdk.codec.checks import Bounds
from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.sdk.packet_codec import PacketCodec
from nondum.sdk.wire_fields import Name, Number

PROTOCOL_VERSIONS: tuple[int, ...] = (1,)
"""Versions that this SDK speaks, newest first. A host speaks its own and the one before."""

MAX_PACKET = 65_536
"""Bytes in a packet."""
MAX_DEPTH = 16
"""Tables and lists within each other, the envelope included."""
MAX_ITEMS = 10_000
"""Entries in one table or list."""

Body: TypeAlias = Mapping[str, Any]


@frozen
class Hello:
    """The worker's first packet."""

    versions: Annotated[tuple[Number, ...], Bounds(1, MAX_ITEMS)]
    """Protocol versions that it speaks."""
    sdk: Name
    """Version of its nondum-sdk."""
    pid: Number


@frozen
class Welcome:
    """The host's answer: the version to speak, and what the worker needs to know of its place."""

    version: Number
    body: Body


@frozen
class Request:
    """Asks the other end to do something; answered by one Reply or Failure of the same id."""

    id: Number
    verb: Name
    body: Body


@frozen
class Reply:
    """A request was carried out."""

    id: Number
    body: Body


@frozen
class Failure:
    """A request failed, or was halted (code HALTED)."""

    id: Number
    problems: Annotated[tuple[Problem, ...], Bounds(1, MAX_ITEMS)]


@frozen
class Event:
    """Something happened; not answered."""

    name: Name
    call_id: Number | None
    """The request that it belongs to."""
    body: Body


@frozen
class Cancel:
    """Halt a request; the answer still comes."""

    id: Number


WireMessage: TypeAlias = Hello | Welcome | Request | Reply | Failure | Event | Cancel
"""The number of a kind in packets is its place here."""


_PACKETS: PacketCodec[WireMessage] = PacketCodec(get_args(WireMessage))


def encode(message: WireMessage, limit: int = MAX_PACKET) -> bytes:
    """Make the packet of a message.

    Raises `ProtocolViolation` for what the other end would refuse (too long, too deep, NaN) and
    `TypeError` for values that are no plain data.
    """
    return pack(_PACKETS.fields(message), limit)


def decode(data: bytes | memoryview, limit: int = MAX_PACKET) -> WireMessage:
    """Read a packet. Raises `ProtocolViolation` for anything that is not one exact message."""
    return _PACKETS.message(unpack(data, limit))


def pack(value: Any, limit: int = MAX_PACKET) -> bytes:
    """Pack plain data that `unpack` will take. Raises `ProtocolViolation`, `TypeError`."""
    _check(value, MAX_DEPTH)
    try:
        data: bytes = msgpack.packb(value, use_bin_type=True)
    except (ValueError, OverflowError) as error:  # surrogates, integers beyond 64 bits
        raise _violation("PACKET_VALUE", str(error)) from error
    if len(data) > limit:
        raise _violation("PACKET_TOO_LONG", f"{len(data)} bytes in a packet of at most {limit}")
    return data


def unpack(data: bytes | memoryview, limit: int = MAX_PACKET) -> Any:
    """Unpack plain data: one value, no extensions, no NaN, no duplicate or odd keys."""
    if len(data) > limit:
        raise _violation("PACKET_TOO_LONG", f"{len(data)} bytes in a packet of at most {limit}")
    try:
        value = msgpack.unpackb(
            data,
            raw=False,
            strict_map_key=True,
            object_pairs_hook=_table,
            max_array_len=MAX_ITEMS,
            max_map_len=MAX_ITEMS,
            max_ext_len=0,
        )
    except ProtocolViolation:
        raise
    except (ValueError, TypeError, OverflowError, RecursionError, msgpack.UnpackException) as error:
        raise _violation("PACKET_MALFORMED", f"{type(error).__name__}: {error}") from error
    _check(value, MAX_DEPTH)
    return value


def _table(pairs: Iterable[tuple[Any, Any]]) -> dict[str, Any]:
    listed = pairs if type(pairs) is list else list(pairs)  # msgpack in C gives a list
    table = dict(listed)
    if len(table) != len(listed):
        raise _violation("PACKET_MALFORMED", "a table has the same key twice")
    return table


_LISTS = frozenset({list, tuple})
_LEAVES = frozenset({str, int, bool, type(None), bytes, bytearray, memoryview})


def _check(value: Any, depth: int) -> None:
    """Refuse what is too deep, too long, not finite, or not plain data.

    Both ends run it on every packet, so leaves are passed over without a call.
    """
    kind = type(value)  # asked of all tables and lists: `isinstance` takes longer
    if kind is dict or (kind not in _LISTS and isinstance(value, Mapping)):
        if depth <= 0 or len(value) > MAX_ITEMS:
            raise _oversized(value, depth)
        for key, item in value.items():
            if type(key) is not str:
                raise _violation("PACKET_MALFORMED", f"a key is of type {type(key).__name__}")
            if type(item) not in _LEAVES:
                _check(item, depth - 1)
    elif kind in _LISTS or isinstance(value, list | tuple):
        if depth <= 0 or len(value) > MAX_ITEMS:
            raise _oversized(value, depth)
        for item in value:
            if type(item) not in _LEAVES:
                _check(item, depth - 1)
    elif isinstance(value, float):
        if not math.isfinite(value):
            raise _violation("PACKET_VALUE", f"{value} is no finite number")
    elif kind not in _LEAVES and not isinstance(value, str | int):  # enums are packed
        raise TypeError(f"{kind.__name__} is no plain data for a packet")


def _oversized(value: Mapping[str, Any] | Sequence[Any], depth: int) -> ProtocolViolation:
    if depth <= 0:
        return _violation("PACKET_TOO_DEEP", f"more than {MAX_DEPTH} levels")
    return _violation("PACKET_TOO_LONG", f"{len(value)} entries, at most {MAX_ITEMS}")


def _violation(code: str, message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem(code, message))
