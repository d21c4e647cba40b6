"""Fields of messages, read strictly and written plainly, as their types say.

A message is a frozen dataclass. Its wire form is a table of plain values (the *header* of a
packet) and at most one buffer of bytes, so that pixels are never packed.
"""

from __future__ import annotations

import dataclasses
import operator
import types
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar, Self, TypeAlias, Union, get_args, get_origin, get_type_hints

from nondum.sdk.codec.checks import Mismatch
from nondum.sdk.codec.values import fields_reader
from nondum.sdk.errors import MessageInvalid, Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.messages.field_types import type_problems

Buffer: TypeAlias = bytes | bytearray | memoryview
"""Bulk bytes of a message: contiguous, never changed once it is sent."""

_Writer: TypeAlias = Callable[[Any], Any]


class Message:
    """What all messages share: their stream type, and the way to the wire and back."""

    __slots__ = ()
    TYPE: ClassVar[str]
    """The stream type in planning: `image`, `twist` …"""
    BUFFER: ClassVar[str | None] = None
    """The field that travels beside the header, as bytes."""

    def to_wire(self) -> tuple[dict[str, Any], Buffer | None]:
        """Give the plain header and the bulk bytes (None where the type has none)."""
        writers = _codec(type(self)).writers
        header = {name: write(getattr(self, name)) for name, write in writers.items()}
        return header, getattr(self, self.BUFFER) if self.BUFFER else None

    @classmethod
    def from_wire(cls, header: Mapping[str, Any], buffer: Buffer | None = None) -> Self:
        """Check what came over a wire and make the message of it.

        The message keeps `buffer` as it is: a caller that passes a view keeps its memory alive.
        Raises `MessageInvalid` (MESSAGE_FIELD for a wrong type, MESSAGE_VALUE for a wrong value).
        """
        try:
            values = _codec(cls).read(header)
            if cls.BUFFER:
                values[cls.BUFFER] = _bulk(buffer, f".{cls.BUFFER}")
            elif buffer is not None:
                raise Mismatch("carries no bulk bytes, but some came")
        except Mismatch as mismatch:
            where = cls.TYPE + mismatch.place
            raise MessageInvalid(Problem("MESSAGE_FIELD", mismatch.reason, where=where)) from None
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


def _bulk(buffer: Buffer | None, place: str) -> Buffer:
    if buffer is None:
        raise Mismatch("bulk bytes are missing", place)
    return buffer


@frozen
class _Codec:
    """How one dataclass is read and written."""

    read: Callable[[Any], dict[str, Any]]
    writers: Mapping[str, _Writer]


def _codec(cls: type[Any]) -> _Codec:
    found = _codecs.get(cls)
    if found is None:
        found = _codecs[cls] = _make_codec(cls)
    return found


_codecs: dict[type[Any], _Codec] = {}


def _make_codec(cls: type[Any]) -> _Codec:
    hints = get_type_hints(cls)
    buffer = getattr(cls, "BUFFER", None)
    names = [field.name for field in dataclasses.fields(cls) if field.name != buffer]
    writers = {name: _writer(hints[name]) for name in names}
    return _Codec(fields_reader(cls, without=buffer), writers)


def _writer(hint: Any) -> _Writer:
    if hint in _SCALARS:
        return _SCALARS[hint]
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


def _is_optional(hint: Any) -> bool:
    return get_origin(hint) in (Union, types.UnionType) and type(None) in get_args(hint)


# Writers also take numpy's scalars, which msgpack would refuse.
_SCALARS: Mapping[Any, _Writer] = {float: float, int: operator.index, str: str}
