"""The envelope of a worker link: one msgpack message per packet, with strict limits.

Pure: values in, bytes out, and back. Whatever a hostile peer sends, `decode` gives a `WireMessage`
or raises `ProtocolViolation`, and never makes more memory of a packet than its length warrants.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import msgpack

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.wire_fields import (
    read_body,
    read_number,
    read_problem,
    read_text,
)

PROTOCOL_VERSIONS: tuple[int, ...] = (1,)
"""Versions that this SDK speaks, newest first. A host speaks its own and the one before."""

MAX_PACKET = 65_536
"""Bytes in a packet."""
MAX_DEPTH = 16
"""Tables and lists within each other, the envelope included."""
MAX_ITEMS = 10_000
"""Entries in one table or list."""

Body: TypeAlias = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Hello:
    """The worker's first packet."""

    versions: tuple[int, ...]
    """Protocol versions that it speaks."""
    sdk: str
    """Version of its nondum-sdk."""
    pid: int


@dataclass(frozen=True, slots=True)
class Welcome:
    """The host's answer: the version to speak, and what the worker needs to know of its place."""

    version: int
    body: Body


@dataclass(frozen=True, slots=True)
class Request:
    """Asks the other end to do something; answered by one Reply or Failure of the same id."""

    id: int
    verb: str
    body: Body


@dataclass(frozen=True, slots=True)
class Reply:
    """A request was carried out."""

    id: int
    body: Body


@dataclass(frozen=True, slots=True)
class Failure:
    """A request failed, or was halted (code HALTED)."""

    id: int
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class Event:
    """Something happened; not answered."""

    name: str
    call_id: int | None
    """The request that it belongs to."""
    body: Body


@dataclass(frozen=True, slots=True)
class Cancel:
    """Halt a request; the answer still comes."""

    id: int


WireMessage: TypeAlias = Hello | Welcome | Request | Reply | Failure | Event | Cancel


def encode(message: WireMessage) -> bytes:
    """Make the packet of a message.

    Raises `ProtocolViolation` for what the other end would refuse (too long, too deep, NaN) and
    `TypeError` for values that are no plain data.
    """
    match message:
        case Hello(versions, sdk, pid):
            fields: tuple[Any, ...] = (0, versions, sdk, pid)
        case Welcome(version, body):
            fields = (1, version, body)
        case Request(id_, verb, body):
            fields = (2, id_, verb, body)
        case Reply(id_, body):
            fields = (3, id_, body)
        case Failure(id_, problems):
            fields = (4, id_, [problem.to_dict() for problem in problems])
        case Event(name, call_id, body):
            fields = (5, name, call_id, body)
        case Cancel(id_):
            fields = (6, id_)
    return pack(fields)


def decode(data: bytes | memoryview) -> WireMessage:
    """Read a packet. Raises `ProtocolViolation` for anything that is not one exact message."""
    fields = unpack(data)
    if not isinstance(fields, list) or not fields or type(fields[0]) is not int:
        raise _violation("PACKET_KIND", "a packet is a list that begins with its kind")
    if not 0 <= fields[0] < len(_READERS):
        raise _violation("PACKET_KIND", f"no kind of packet has the number {fields[0]}")
    length, read = _READERS[fields[0]]
    if len(fields) != length:
        raise _violation(
            "PACKET_FIELDS", f"kind {fields[0]} has {length} fields, found {len(fields)}"
        )
    return read(fields)


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
    listed = list(pairs)
    table = dict(listed)
    if len(table) != len(listed):
        raise _violation("PACKET_MALFORMED", "a table has the same key twice")
    return table


_LEAVES = frozenset({str, int, bool, type(None), bytes, bytearray, memoryview})


def _check(value: Any, depth: int) -> None:
    """Refuse what is too deep, too long, not finite, or not plain data.

    Both ends run it on every packet, so leaves are passed over without a call.
    """
    if isinstance(value, list | tuple):
        _check_size(value, depth)
        for item in value:
            if type(item) not in _LEAVES:
                _check(item, depth - 1)
    elif isinstance(value, Mapping):
        _check_size(value, depth)
        for key, item in value.items():
            if type(key) is not str:
                raise _violation("PACKET_MALFORMED", f"a key is of type {type(key).__name__}")
            if type(item) not in _LEAVES:
                _check(item, depth - 1)
    elif isinstance(value, float):
        if not math.isfinite(value):
            raise _violation("PACKET_VALUE", f"{value} is no finite number")
    elif type(value) not in _LEAVES and not isinstance(value, str | int):  # enums are packed
        raise TypeError(f"{type(value).__name__} is no plain data for a packet")


def _check_size(value: Mapping[str, Any] | Sequence[Any], depth: int) -> None:
    if depth <= 0:
        raise _violation("PACKET_TOO_DEEP", f"more than {MAX_DEPTH} levels")
    if len(value) > MAX_ITEMS:
        raise _violation("PACKET_TOO_LONG", f"{len(value)} entries, at most {MAX_ITEMS}")


def _read_hello(fields: list[Any]) -> Hello:
    versions = fields[1]
    if not isinstance(versions, list) or not versions:
        raise _violation("PACKET_FIELDS", "versions are a list of whole numbers")
    return Hello(
        tuple(read_number(v) for v in versions), read_text(fields[2]), read_number(fields[3])
    )


def _read_welcome(fields: list[Any]) -> Welcome:
    return Welcome(read_number(fields[1]), read_body(fields[2]))


def _read_request(fields: list[Any]) -> Request:
    return Request(read_number(fields[1]), read_text(fields[2]), read_body(fields[3]))


def _read_reply(fields: list[Any]) -> Reply:
    return Reply(read_number(fields[1]), read_body(fields[2]))


def _read_failure(fields: list[Any]) -> Failure:
    problems = fields[2]
    if not isinstance(problems, list) or not problems:
        raise _violation("PACKET_FIELDS", "a failure names at least one problem")
    return Failure(read_number(fields[1]), tuple(read_problem(problem) for problem in problems))


def _read_event(fields: list[Any]) -> Event:
    call_id = None if fields[2] is None else read_number(fields[2])
    return Event(read_text(fields[1]), call_id, read_body(fields[3]))


def _read_cancel(fields: list[Any]) -> Cancel:
    return Cancel(read_number(fields[1]))


_READERS: tuple[tuple[int, Callable[[list[Any]], WireMessage]], ...] = (
    (4, _read_hello),
    (3, _read_welcome),
    (4, _read_request),
    (3, _read_reply),
    (3, _read_failure),
    (4, _read_event),
    (2, _read_cancel),
)
"""By kind: how many fields a packet has, and how they are read."""


def _violation(code: str, message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem(code, message))
