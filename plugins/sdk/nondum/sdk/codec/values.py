"""Typed values to plain data and back, as the annotations of frozen dataclasses say. Pure.

    @frozen
    class Mount:
        device: Annotated[str, matching(DEVICE)]
        diskseq: int | None

    from_plain(Mount, {"device": "sdb1", "diskseq": 7}) == Mount("sdb1", 7)

A field holds a text, a number, a boolean, bytes, a `Path` (a text, when plain), an `Enum` (its
value), a tuple or frozenset (a list), a `Mapping` from texts or another dataclass (a table), any of
these `| None`, or `Any`, which is plain data already: nothing of it is looked at, nor the keys of a
table of it. `Annotated[T, check]` is a T that `check` admits. Reading converts nothing: True is no
number and a number no text; only a whole number may stand where a `float` is expected. Keys are
those of the fields: no others, and none is missing that has no default. All fields are written, but
for those with `OMIT_DEFAULT`.
"""

from __future__ import annotations

import dataclasses
import math
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import Enum
from functools import cache
from itertools import repeat
from pathlib import Path
from typing import (
    Annotated,
    Any,
    NewType,
    TypeAlias,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

from nondum.sdk.codec.checks import Bounds, Mismatch

OMIT_DEFAULT: Mapping[str, str] = {"omit": "default"}
"""Metadata of a field that is written only where it differs from its default."""

_T = TypeVar("_T")
Reader: TypeAlias = Callable[[Any], Any]
"""Gives the value of plain data. Raises `Mismatch`."""


def from_plain(cls: type[_T], data: object, where: str = "") -> _T:
    """Check plain data and make the value of it.

    Raises `Mismatch` with its place: `where`, and the way from there.
    """
    try:
        return cast(_T, reader(cast(Any, cls))(data))
    except Mismatch as mismatch:
        raise mismatch.within(where) from None


def to_plain(value: Any) -> Any:
    """A value as JSON or msgpack can carry it.

    >>> to_plain({"at": Path("/media/a"), "of": frozenset({"b", "a"})})
    {'at': '/media/a', 'of': ['a', 'b']}
    """
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, str | int | None):
        return value
    if isinstance(value, tuple | list):
        return [to_plain(item) for item in value]
    if isinstance(value, Mapping):
        return {key: to_plain(item) for key, item in value.items()}
    if isinstance(value, frozenset):
        return sorted(to_plain(item) for item in value)
    if isinstance(value, Path):
        return str(value)
    if dataclasses.is_dataclass(value):
        held = ((field, getattr(value, field.name)) for field in dataclasses.fields(value))
        return {f.name: to_plain(v) for f, v in held if "omit" not in f.metadata or v != f.default}
    return value


@cache
def reader(hint: Any) -> Reader:
    """How values of a type are read. Raises `TypeError` for a type that is none of plain data."""
    origin, arguments = get_origin(hint), get_args(hint)
    if hint is Any:
        return lambda value: value
    if hint in _SCALARS:
        return _SCALARS[hint]
    if isinstance(hint, NewType):
        return reader(hint.__supertype__)
    if origin is Annotated:
        return _checked(hint.__origin__, hint.__metadata__)
    if origin in (Union, types.UnionType) and arguments[1:] == (types.NoneType,):
        inner = reader(arguments[0])
        return lambda value: None if value is None else inner(value)
    if origin is tuple and arguments[1:] != (...,):
        return _fixed(tuple(map(reader, arguments)))
    if origin in (tuple, frozenset):
        return _items(origin, reader(arguments[0]))
    if origin is Mapping and arguments[0] is str:
        return _table if arguments[1] is Any else _table_of(reader(arguments[1]))
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _member(hint)
    if dataclasses.is_dataclass(hint):
        return _dataclass(cast(type, hint))
    raise TypeError(f"{hint!r} is no type of plain data")


def fields_reader(cls: type, without: str | None = None) -> Callable[[Any], dict[str, Any]]:
    """How the fields of a dataclass are read from a table, but for one that is not in it."""
    hints = get_type_hints(cls, include_extras=True)
    fields = [field for field in dataclasses.fields(cls) if field.name != without]
    readers = {field.name: reader(hints[field.name]) for field in fields}
    missing = dataclasses.MISSING
    required = {f.name for f in fields if f.default is missing and f.default_factory is missing}

    def read(data: Any) -> dict[str, Any]:
        if not isinstance(data, Mapping):
            raise Mismatch(f"expected a table for {cls.__name__}, found {type(data).__name__}")
        if not data.keys() <= readers.keys():
            unknown = min(str(key) for key in data if key not in readers)
            raise Mismatch(f"unknown key {unknown!r}; known: {', '.join(sorted(readers))}")
        if not required <= data.keys():
            raise Mismatch(f"key {min(required - data.keys())!r} is missing")
        name, values = "", {}
        try:
            for name, value in data.items():
                values[name] = readers[name](value)
        except Mismatch as mismatch:
            raise mismatch.within(f".{name}") from None
        return values

    return read


def _dataclass(cls: type) -> Reader:
    read = fields_reader(cls)
    return lambda data: cls(**read(data))


def _exactly(kind: type, expected: str) -> Reader:
    def read(value: Any) -> Any:
        if type(value) is not kind:
            raise Mismatch(f"expected {expected}, found {type(value).__name__}")
        return value

    return read


def _float(value: Any) -> float:
    if type(value) not in (float, int):
        raise Mismatch(f"expected a number, found {type(value).__name__}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise Mismatch("expected a finite number")
    return number


_MEASURES = frozenset({int, str, bytes})
_text = _exactly(str, "a text")

_SCALARS: Mapping[Any, Reader] = {
    str: _text,
    int: _exactly(int, "a whole number"),
    bool: _exactly(bool, "true or false"),
    bytes: _exactly(bytes, "bytes"),
    float: _float,
    Path: lambda value: Path(_text(value)),
}


def _checked(hint: Any, checks: tuple[Any, ...]) -> Reader:
    read = reader(hint)
    match hint, checks:
        case type() as kind, [Bounds() as bounds] if kind in _MEASURES:
            return _bounded(read, kind, bounds)

    def read_checked(data: Any) -> Any:
        value = read(data)
        for check in checks:
            check(value)
        return value

    return read_checked


def _bounded(read: Reader, kind: Any, bounds: Bounds) -> Reader:
    """Read as two calls would, in one: most fields of packets are such."""
    least, most = bounds.least, bounds.most

    def read_number(data: Any) -> Any:
        if type(data) is not kind or not least <= data <= most:
            bounds(read(data))  # one of them refuses it
        return data

    def read_sized(data: Any) -> Any:
        if type(data) is not kind or not least <= len(data) <= most:
            bounds(read(data))
        return data

    return read_number if kind is int else read_sized


def _each(readers: Iterable[Reader], items: Sequence[Any]) -> list[Any]:
    values: list[Any] = []
    try:
        for read, item in zip(readers, items, strict=False):  # one reader may be for all of them
            values.append(read(item))
    except Mismatch as mismatch:
        raise mismatch.within(f"[{len(values)}]") from None
    return values


def _items(kind: Callable[[list[Any]], Any], read: Reader) -> Reader:
    return lambda data: kind(_each(repeat(read), _list(data)))


def _fixed(readers: tuple[Reader, ...]) -> Reader:
    def read_fixed(data: Any) -> tuple[Any, ...]:
        if len(_list(data)) != len(readers):
            raise Mismatch(f"expected {len(readers)} values, found {len(data)}")
        return tuple(_each(readers, data))

    return read_fixed


def _list(data: Any) -> Sequence[Any]:
    if not isinstance(data, list | tuple):
        raise Mismatch(f"expected a list, found {type(data).__name__}")
    return data


def _table(data: Any) -> Mapping[str, Any]:
    if type(data) is not dict and not isinstance(data, Mapping):
        raise Mismatch(f"expected a table, found {type(data).__name__}")
    return data


def _table_of(read: Reader) -> Reader:
    def read_table(data: Any) -> Mapping[str, Any]:
        key, values = "", {}
        table = _table(data)
        try:
            for key, item in table.items():
                values[_text(key)] = read(item)
        except Mismatch as mismatch:
            raise mismatch.within(f"[{key!r}]") from None
        return values

    return read_table


def _member(kind: type[Enum]) -> Reader:
    def read_member(data: Any) -> Enum:
        for member in kind:
            if type(data) is type(member.value) and data == member.value:
                return member
        known = ", ".join(repr(member.value) for member in kind)
        raise Mismatch(f"expected one of {known}, found {data!r:.40}")

    return read_member
