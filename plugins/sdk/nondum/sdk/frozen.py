"""`frozen`: a data class whose objects never change, and which costs little to define.

It is what `dataclasses.dataclass(frozen=True, slots=True)` makes, with the same fields, `replace`,
`match` and errors. That one compiles six functions for each class whenever a module is imported,
which was half of the time and a tenth of the memory of a daemon's start. Here classes share what is
not in a hurry, and the rest is compiled when it is used first.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import MISSING, Field, FrozenInstanceError, fields
from typing import Any, TypeAlias, TypeVar, dataclass_transform

_T = TypeVar("_T")
_Names: TypeAlias = dict[str, Any]
"""What compiled functions know beside builtins."""
_Source: TypeAlias = tuple[Sequence[str], Sequence[str]]
"""Parameters of a function, and the lines of its body."""


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field,))
def frozen(cls: type[_T]) -> type[_T]:
    """Make a data class of a class, with slots; its objects are equal if their fields are, can be
    hashed, and cannot be changed.

    `dataclasses.field` takes `default`, `default_factory`, `init`, `repr`, `compare` and `hash`. A
    class may have its own `__eq__`, `__hash__` and `__repr__`, and be derived from a frozen one.
    """
    own = vars(cls)
    made: Any = dataclasses.dataclass(init=False, repr=False, eq=False, slots=True)(cls)
    shared = {
        "__repr__": _repr,
        "__setattr__": _refuse_to_set,
        "__delattr__": _refuse_to_delete,
        "__getstate__": _getstate,
        "__setstate__": _setstate,
        **{name: _Uncompiled(made, name, source) for name, source in _SOURCES.items()},
    }
    for name, function in shared.items():
        if own.get(name) is None:  # `__hash__` is, where there is an `__eq__`
            setattr(made, name, function)
    return made  # type: ignore[no-any-return]  # what was given, with slots


class _Uncompiled:
    """In place of a method, until it is asked for."""

    __slots__ = ("_cls", "_name", "_source")

    def __init__(self, cls: type, name: str, source: Callable[[Any, _Names], _Source]) -> None:
        self._cls, self._name, self._source = cls, name, source

    def __get__(self, instance: object, owner: type | None = None) -> Callable[..., Any]:
        known: _Names = {}
        parameters, body = self._source(self._cls, known)
        lines = "".join(f"\n {line}" for line in body)
        # Nothing in it is foreign but the names of fields, which are identifiers.
        exec(f"def {self._name}({', '.join(parameters)}):{lines}", known)
        method = known[self._name]
        method.__qualname__ = f"{self._cls.__qualname__}.{self._name}"
        method.__module__ = self._cls.__module__
        if self._name == "__init__":
            given = {field.name: field.type for field in fields(self._cls) if field.init}
            method.__annotations__ = {**given, "return": None}
        setattr(self._cls, self._name, method)
        return method if instance is None else method.__get__(instance)  # type: ignore[no-any-return]


def _init_source(cls: Any, known: _Names) -> _Source:
    known.update(__set=object.__setattr__, __MISSING=MISSING)  # names that no field has
    parameters, body = ["self"], ["pass"]
    for number, field in enumerate(fields(cls)):
        default, value = _default(field, f"__default_{number}", known)
        if field.init:
            parameters.append(f"{field.name}={default}" if default else field.name)
        if field.init or default:
            body.append(f"__set(self, {field.name!r}, {value})")
    if hasattr(cls, "__post_init__"):
        body.append("self.__post_init__()")
    return parameters, body


def _default(field: Field[Any], name: str, known: _Names) -> tuple[str, str]:
    """What stands for a default among the parameters, and what the field is set to."""
    if field.default_factory is not MISSING:
        known[name] = field.default_factory
        made = f"{name}() if {field.name} is __MISSING else {field.name}"
        return "__MISSING", made if field.init else f"{name}()"
    if field.default is not MISSING:
        known[name] = field.default
        return name, field.name if field.init else name
    return "", field.name


def _eq_source(cls: Any, known: _Names) -> _Source:
    names = [field.name for field in fields(cls) if field.compare]
    body = (
        "if other.__class__ is not self.__class__: return NotImplemented",
        f"return {_tuple('self', names)} == {_tuple('other', names)}",
    )
    return ("self", "other"), body


def _hash_source(cls: Any, known: _Names) -> _Source:
    names = [f.name for f in fields(cls) if (f.compare if f.hash is None else f.hash)]
    return ("self",), (f"return hash({_tuple('self', names)})",)


def _tuple(of: str, names: Iterable[str]) -> str:
    return f"({''.join(f'{of}.{name}, ' for name in names)})"


_SOURCES = {"__init__": _init_source, "__eq__": _eq_source, "__hash__": _hash_source}


def _repr(self: Any) -> str:
    told = (f"{f.name}={getattr(self, f.name)!r}" for f in fields(self) if f.repr)
    return f"{type(self).__qualname__}({', '.join(told)})"


def _refuse_to_set(self: object, name: str, value: object) -> None:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_to_delete(self: object, name: str) -> None:
    raise FrozenInstanceError(f"cannot delete field {name!r}")


def _getstate(self: Any) -> list[Any]:
    return [getattr(self, f.name) for f in fields(self)]


def _setstate(self: Any, state: list[Any]) -> None:
    for field, value in zip(fields(self), state, strict=True):
        object.__setattr__(self, field.name, value)
