"""Settings of a component: what an integrator wrote, checked once, as the author's own type."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from nondum.sdk.errors import ConfigRefused, Problem

_T = TypeVar("_T")


def parse_settings(cls: type[_T], given: Mapping[str, object], *, where: str) -> _T:
    """Make the dataclass `cls` of settings from outside.

    Its fields have defaults and are of type float (whole numbers are taken too), int, bool, str
    or a Literal of texts. Ranges are the dataclass's own matter: a `ValueError` that it raises
    when made is told like any other mistake.

    Raises `ConfigRefused` (SETTING_INVALID) with everything that is wrong.
    """
    hints = get_type_hints(cls)
    fields = {field.name: hints[field.name] for field in dataclasses.fields(cls)}  # type: ignore[arg-type]  # only called with dataclasses
    faults = list(_faults(fields, given))
    if not faults:
        values = {k: float(v) if fields[k] is float else v for k, v in given.items()}  # type: ignore[arg-type]  # a number, as just checked
        try:
            return cls(**values)
        except ValueError as error:
            faults.append(str(error))
    raise ConfigRefused(*(Problem("SETTING_INVALID", fault, where=where) for fault in faults))


def _faults(fields: Mapping[str, Any], given: Mapping[str, object]) -> Iterator[str]:
    for key, value in given.items():
        if key not in fields:
            yield f"there is no setting {key!r}; known: {', '.join(fields)}"
        elif not _fits(fields[key], value):
            yield f"setting {key!r} must be {_in_words(fields[key])}, not {value!r}"


def _fits(hint: Any, value: object) -> bool:
    if get_origin(hint) is Literal:
        return value in get_args(hint)
    if hint is float:
        return type(value) in (int, float) and math.isfinite(value)  # type: ignore[arg-type]  # a number, by its type
    return type(value) is hint


def _in_words(hint: Any) -> str:
    if get_origin(hint) is Literal:
        return "one of " + ", ".join(repr(value) for value in get_args(hint))
    return {float: "a number", int: "a whole number", bool: "true or false"}.get(hint, "text")
