"""Fields of messages, read strictly and written plainly, as their types say.

A message is a frozen dataclass. Its wire form is a table of plain values (the *header* of a
packet) and at most one buffer of bytes, so that pixels are never packed.
"""

from __future__ import annotations

import dataclasses
import math
import operator
import types
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar, Self, TypeAlias, Union, get_args, get_origin, get_type_hints

from nondum.sdk.errors import MessageInvalid, Problem
from nondum.sdk.messages.field_types import type_problems

Buffer: TypeAlias = bytes | bytearray | memoryview
"""Bulk bytes of a message: contiguous, never changed once it is sent."""

_Reader: TypeAlias = Callable[[object, str], Any]
_Writer: TypeAlias = Callable[[Any], Any]


class _Wrong(Exception):
    """A field that is not what its type says."""

    def __init__(self, where: str, message: str) -> None:
        super().__init__(message)
        self.where = where


class Message:
    """What all messages share: their stream type, and the way to the wire and back."""

    __slots__ = ()
    TYPE: ClassVar[str]
    """The stream type in planning: `image`, `twist` …"""
    BUFFER: ClassVar[str | None] = None
    """The field that travels beside the header, as bytes."""

    def to_wire(self) -> tuple[dict[str, Any], Buffer | None]:
        """Give the plain header and the bulk bytes (None where the type has none)."""
        codec = _codec(type(self))
        header = {name: write(getattr(self, name)) for name, write in codec.writers.items()}
        return header, getattr(self, self.BUFFER) if self.BUFFER else None

    @classmethod
    def from_wire(cls, header: Mapping[str, Any], buffer: Buffer | None = None) -> Self:
        """Check what came over a wire and make the message of it.

        The message keeps `buffer` as it is: a caller that passes a view keeps its memory alive.
        Raises `MessageInvalid` (MESSAGE_FIELD for a wrong type, MESSAGE_VALUE for a wrong value).
        """
        try:
            values = _codec(cls).read(header, cls.TYPE)
            if cls.BUFFER:
                values[cls.BUFFER] = _bulk(buffer, f"{cls.TYPE}.{cls.BUFFER}")
            elif buffer is not None:
                raise _Wrong(cls.TYPE, "carries no bulk bytes, but some came")
        except _Wrong as wrong:
            raise MessageInvalid(Problem("MESSAGE_FIELD", str(wrong), where=wrong.where)) from None
        message = cls(**values)
        message._check_values()  # the types were just read
        return message

    def faults(self) -> Iterator[str]:
        """Say what is wrong with the values, beyond their types. Messages override it."""
        yield from ()

    def check(self) -> None:
        """Check a message that was made here: its fields' types, then their values.

        Bulk bytes are not looked at, but for their length. Raises `MessageInvalid` (MESSAGE_FIELD
        for a wrong type or shape, MESSAGE_VALUE for a wrong value) with every fault at once.
        """
        wrong = type_problems(self)
        if wrong:
            raise MessageInvalid(*wrong)
        self._check_values()

    def _check_values(self) -> None:
        faults = tuple(self.faults())
        if faults:
            raise MessageInvalid(
                *(Problem("MESSAGE_VALUE", fault, where=self.TYPE) for fault in faults)
            )


def _bulk(buffer: Buffer | None, where: str) -> Buffer:
    if buffer is None:
        raise _Wrong(where, "bulk bytes are missing")
    return buffer


@dataclasses.dataclass(frozen=True, slots=True)
class _Codec:
    """How one dataclass is read and written."""

    readers: Mapping[str, _Reader]
    writers: Mapping[str, _Writer]
    required: frozenset[str]

    def read(self, data: object, where: str) -> dict[str, Any]:
        if not isinstance(data, Mapping):
            raise _Wrong(where, f"expected a table, found {type(data).__name__}")
        unknown = [key for key in data if key not in self.readers]
        if unknown:
            raise _Wrong(where, f"unknown field {unknown[0]!r}")
        missing = self.required - data.keys()
        if missing:
            raise _Wrong(where, f"field {min(missing)!r} is missing")
        return {name: self.readers[name](value, f"{where}.{name}") for name, value in data.items()}


def _codec(cls: type[Any]) -> _Codec:
    found = _codecs.get(cls)
    if found is None:
        found = _codecs[cls] = _make_codec(cls)
    return found


_codecs: dict[type[Any], _Codec] = {}


def _make_codec(cls: type[Any]) -> _Codec:
    hints = get_type_hints(cls)
    buffer = getattr(cls, "BUFFER", None)
    fields = [field for field in dataclasses.fields(cls) if field.name != buffer]
    missing = dataclasses.MISSING
    return _Codec(
        readers={field.name: _reader(hints[field.name]) for field in fields},
        writers={field.name: _writer(hints[field.name]) for field in fields},
        required=frozenset(
            f.name for f in fields if f.default is missing and f.default_factory is missing
        ),
    )


def _reader(hint: Any) -> _Reader:
    if hint in _SCALARS:
        return _SCALARS[hint][0]
    if _is_optional(hint):
        inner = _reader(get_args(hint)[0])
        return lambda value, where: None if value is None else inner(value, where)
    if get_origin(hint) is tuple:
        return _tuple_reader(*get_args(hint))
    return lambda value, where: hint(**_codec(hint).read(value, where))


def _writer(hint: Any) -> _Writer:
    if hint in _SCALARS:
        return _SCALARS[hint][1]
    if _is_optional(hint):
        inner = _writer(get_args(hint)[0])
        return lambda value: None if value is None else inner(value)
    if get_origin(hint) is tuple:
        item = _writer(get_args(hint)[0])
        return lambda value: [item(one) for one in value]
    codec = _codec(hint)
    return lambda value: {
        name: write(getattr(value, name)) for name, write in codec.writers.items()
    }


def _tuple_reader(item: Any, *rest: Any) -> _Reader:
    read = _reader(item)
    length = None if rest == (...,) else 1 + len(rest)

    def read_tuple(value: object, where: str) -> tuple[Any, ...]:
        if not isinstance(value, list | tuple):
            raise _Wrong(where, f"expected a list, found {type(value).__name__}")
        if length is not None and len(value) != length:
            raise _Wrong(where, f"expected {length} values, found {len(value)}")
        return tuple(read(one, f"{where}[{i}]") for i, one in enumerate(value))

    return read_tuple


def _is_optional(hint: Any) -> bool:
    return get_origin(hint) in (Union, types.UnionType) and type(None) in get_args(hint)


def _read_float(value: object, where: str) -> float:
    if type(value) not in (float, int):
        raise _Wrong(where, f"expected a number, found {type(value).__name__}")
    number = float(value)  # type: ignore[arg-type]  # float or int, as just checked
    if not math.isfinite(number):
        raise _Wrong(where, "expected a finite number")
    return number


def _read_int(value: object, where: str) -> int:
    if type(value) is not int:
        raise _Wrong(where, f"expected a whole number, found {type(value).__name__}")
    return value


def _read_str(value: object, where: str) -> str:
    if type(value) is not str:
        raise _Wrong(where, f"expected text, found {type(value).__name__}")
    return value


# The writers also take numpy's scalars, which msgpack would refuse.
_SCALARS: Mapping[Any, tuple[_Reader, _Writer]] = {
    float: (_read_float, float),
    int: (_read_int, operator.index),
    str: (_read_str, str),
}
