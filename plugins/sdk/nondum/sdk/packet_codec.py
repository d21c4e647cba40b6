"""Packets: lists that begin with a number, their kind, and go on with the fields of a dataclass.

    PACKETS: PacketCodec[Ask | Answer] = PacketCodec((Ask, Answer))
    PACKETS.fields(Answer(7)) == (1, 7)
    PACKETS.message([1, 7]) == Answer(7)

Pure: `nondum.sdk.wire.pack` makes bytes of such a list. The number of a kind is its place in the
tuple. Fields stand in the order of their class, and are read as `nondum.sdk.codec.values` says.
The last one may be `Annotated[T, FLAT]`: then the fields of that dataclass stand in its place; if
it is `T | None`, they may be missing.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter
from types import NoneType
from typing import Annotated, Any, Generic, NewType, TypeVar, get_args, get_origin, get_type_hints

from nondum.sdk.codec.checks import Mismatch
from nondum.sdk.codec.values import reader, to_plain
from nondum.sdk.errors import Problem, ProtocolViolation

FLAT = object()
"""Marks the last field of a packet, if the fields of its value stand in the list."""

_Message = TypeVar("_Message")
_PLAIN = {str, int, float, bool, bytes, NoneType, Any, ...}


class PacketCodec(Generic[_Message]):
    """The kinds of packets that one end sends."""

    def __init__(self, kinds: Sequence[type[_Message]]) -> None:
        self._numbers = {kind: number for number, kind in enumerate(kinds)}
        self._kinds = dict(enumerate(map(_Kind, kinds)))

    def fields(self, message: _Message) -> tuple[Any, ...]:
        """The list of a message: its kind, then its fields."""
        number = self._numbers[type(message)]
        return (number, *self._kinds[number].write(message))

    def message(self, fields: object) -> _Message:
        """The message of a list. Raises `ProtocolViolation` (PACKET_KIND, PACKET_FIELDS)."""
        if not isinstance(fields, list) or not fields or type(fields[0]) is not int:
            raise _violation("PACKET_KIND", "a packet is a list that begins with its kind")
        kind = self._kinds.get(fields[0])
        if kind is None:
            raise _violation("PACKET_KIND", f"no kind of packet has the number {fields[0]}")
        try:
            message: _Message = kind.read(fields[1:])
        except Mismatch as mismatch:
            raise violation(mismatch, kind.name) from None
        return message


def violation(mismatch: Mismatch, where: str = "") -> ProtocolViolation:
    """What a stranger's packet with such a field is refused with (PACKET_FIELDS)."""
    return _violation("PACKET_FIELDS", mismatch.reason, where + mismatch.place)


def _violation(code: str, message: str, where: str = "") -> ProtocolViolation:
    return ProtocolViolation(Problem(code, message, where=where))


class _Kind:
    """How the fields of a dataclass stand in a list."""

    def __init__(self, cls: type) -> None:
        hints = get_type_hints(cls, include_extras=True)
        names = [field.name for field in dataclasses.fields(cls)]
        self.name = cls.__name__
        self._cls = cls
        self._flat = _Flat(names.pop(), hints) if names and _is_flat(hints[names[-1]]) else None
        self._names = tuple(names)
        self._readers = tuple(reader(hints[name]) for name in names)
        self._get = _getter(self._names)
        self._typed = [at for at, name in enumerate(names) if not _is_plain(hints[name])]
        more = self._flat.lengths if self._flat else (0,)
        self.lengths: tuple[int, ...] = tuple(len(names) + length for length in more)
        """How many fields there may be."""

    def write(self, message: Any) -> tuple[Any, ...]:
        """The fields of a message."""
        fields = self._get(message)
        if self._typed:
            plain = list(fields)
            for at in self._typed:
                plain[at] = to_plain(plain[at])
            fields = tuple(plain)
        if self._flat:
            fields += self._flat.write(message)
        return fields

    def read(self, fields: Sequence[Any]) -> Any:
        """The message of its fields. Raises `Mismatch`."""
        if len(fields) not in self.lengths:
            expected = " or ".join(map(str, self.lengths))
            raise Mismatch(f"expected {expected} fields, found {len(fields)}")
        values: list[Any] = []
        try:
            for read, field in zip(self._readers, fields):  # noqa: B905  # `strict` takes time
                values.append(read(field))
        except Mismatch as mismatch:
            raise mismatch.within(f".{self._names[len(values)]}") from None
        if self._flat:
            values.append(self._flat.read(fields[len(values) :]))
        return self._cls(*values)


class _Flat:
    """A last field, whose own fields stand in the list."""

    def __init__(self, name: str, hints: Mapping[str, Any]) -> None:
        hint = hints[name]
        cls, *none = get_args(hint.__origin__) or (hint.__origin__,)
        self._get = attrgetter(name)
        self._kind = _Kind(cls)
        self._checks = [check for check in hint.__metadata__ if check is not FLAT]
        self._is_optional = none == [NoneType]
        self.lengths: tuple[int, ...] = (
            (0, *self._kind.lengths) if self._is_optional else self._kind.lengths
        )

    def write(self, message: Any) -> tuple[Any, ...]:
        value = self._get(message)
        return () if value is None else self._kind.write(value)

    def read(self, fields: Sequence[Any]) -> Any:
        if self._is_optional and not fields:
            return None
        value = self._kind.read(fields)
        for check in self._checks:
            check(value)
        return value


def _is_flat(hint: Any) -> bool:
    return get_origin(hint) is Annotated and FLAT in hint.__metadata__


def _is_plain(hint: Any) -> bool:
    """Whether values of a type are plain data already."""
    if get_origin(hint) is Annotated:
        return _is_plain(hint.__origin__)
    if isinstance(hint, NewType):
        return _is_plain(hint.__supertype__)
    parts = get_args(hint)
    return all(map(_is_plain, parts)) if parts else hint in _PLAIN


def _getter(names: tuple[str, ...]) -> Callable[[Any], tuple[Any, ...]]:
    if len(names) > 1:
        return attrgetter(*names)
    return lambda message: tuple(getattr(message, name) for name in names)
