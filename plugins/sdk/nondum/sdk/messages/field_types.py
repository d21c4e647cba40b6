"""Whether the fields of a message hold what their types say: asked of what a plugin has made.

What comes over a wire is read strictly (`fields`); what an author makes is a plain dataclass, which
takes anything. Each class has its checks made once, of its annotations. A check costs about as much
as the look at a field, and bulk bytes are never read: an image is as quick as a number.
"""

from __future__ import annotations

import dataclasses
import math
import numbers
import operator
import types
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias, Union, get_args, get_origin, get_type_hints

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

_Check: TypeAlias = Callable[[Any], "tuple[str, str] | None"]
"""None where a value is right; else the rest of the way to what is wrong, and what is."""


@frozen
class _Checks:
    """How the fields of one dataclass are checked; it has two of them at least."""

    names: tuple[str, ...]
    fields_of: Callable[[Any], tuple[Any, ...]]
    every: tuple[_Check, ...]


_checks: dict[type[Any], _Checks] = {}


def type_problems(message: Any) -> tuple[Problem, ...]:
    """What is wrong with the types and shapes of a message's fields: MESSAGE_FIELD, one a field."""
    if _is_right(message):
        return ()
    cls = type(message)
    return tuple(
        Problem("MESSAGE_FIELD", told, where=f"{cls.TYPE}{path}") for path, told in _wrong(message)
    )


def _is_right(value: Any) -> bool:
    """Whether nothing is wrong with a value's fields. It is asked of every message."""
    checks = _checks_of(type(value))
    for field, check in zip(checks.fields_of(value), checks.every, strict=True):
        if check(field) is not None:
            return False
    return True


def _wrong(value: Any) -> Iterator[tuple[str, str]]:
    checks = _checks_of(type(value))
    for name, check in zip(checks.names, checks.every, strict=True):
        found = check(getattr(value, name))
        if found is not None:
            yield f".{name}{found[0]}", found[1]


def _checks_of(cls: type[Any]) -> _Checks:
    found = _checks.get(cls)
    if found is None:
        hints, buffer = get_type_hints(cls), getattr(cls, "BUFFER", None)
        names = tuple(field.name for field in dataclasses.fields(cls))
        found = _checks[cls] = _Checks(
            names,
            operator.attrgetter(*names),
            tuple(_check_bulk if n == buffer else _check_of(hints[n]) for n in names),
        )
    return found


def _check_of(hint: Any) -> _Check:
    if hint in _SCALARS:
        return _SCALARS[hint]
    if get_origin(hint) in (Union, types.UnionType):
        inner = _check_of(get_args(hint)[0])
        return lambda value: None if value is None else inner(value)
    if get_origin(hint) is tuple:
        return _tuple_check(*get_args(hint))
    return _value_check(hint)


def _tuple_check(item: Any, *rest: Any) -> _Check:
    check = _check_of(item)
    length = None if rest == (...,) else 1 + len(rest)

    def check_tuple(value: Any) -> tuple[str, str] | None:
        if not isinstance(value, tuple | list):
            return "", f"expected a tuple, found {_named(value)}"
        if length is not None and len(value) != length:
            return "", f"expected {length} values, found {len(value)}"
        for i, one in enumerate(value):
            found = check(one)
            if found is not None:
                return f"[{i}]{found[0]}", found[1]
        return None

    return check_tuple


def _value_check(cls: type[Any]) -> _Check:
    def check_value(value: Any) -> tuple[str, str] | None:
        if type(value) is not cls:
            return "", f"expected a {cls.__name__}, found {_named(value)}"
        return None if _is_right(value) else next(_wrong(value))

    return check_value


def _check_float(value: Any) -> tuple[str, str] | None:
    if type(value) is float:
        return None if math.isfinite(value) else ("", f"expected a finite number, found {value}")
    if type(value) is int:
        return None
    if not isinstance(value, numbers.Real) or isinstance(value, bool):
        return "", f"expected a number, found {_named(value)}"
    return None if math.isfinite(value) else ("", f"expected a finite number, found {value}")


def _check_int(value: Any) -> tuple[str, str] | None:
    if type(value) is int:
        return None
    if not isinstance(value, numbers.Integral) or isinstance(value, bool):
        return "", f"expected a whole number, found {_named(value)}"
    return None


def _check_str(value: Any) -> tuple[str, str] | None:
    return None if isinstance(value, str) else ("", f"expected text, found {_named(value)}")


def _check_bulk(value: Any) -> tuple[str, str] | None:
    try:
        is_whole = memoryview(value).c_contiguous
    except TypeError:
        return "", f"expected bytes, found {_named(value)}"
    return None if is_whole else ("", "expected bytes in one piece, found some with gaps")


def _named(value: Any) -> str:
    return f"{value!r:.40}" if isinstance(value, str | bool) else type(value).__name__


_SCALARS: dict[Any, _Check] = {float: _check_float, int: _check_int, str: _check_str}
