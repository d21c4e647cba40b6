"""What a client said beside the verb, parsed into types. A mistake is told, never passed on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from nondum.sdk.errors import Problem, ProtocolViolation

Triple = tuple[float, float, float]


class Arguments:
    """The arguments of one request; every method raises `ProtocolViolation` (CONTROL_ARGUMENT)."""

    def __init__(self, given: Mapping[str, Any]) -> None:
        self._given = given

    def text(self, name: str) -> str:
        """A text that must be there."""
        text = self.optional_text(name)
        if text is None:
            raise _wrong(name, "a text", None)
        return text

    def optional_text(self, name: str) -> str | None:
        """A text, if one was given.

        >>> Arguments({"words": "follow me"}).optional_text("words")
        'follow me'
        """
        value = self._given.get(name)
        if value is not None and not isinstance(value, str):
            raise _wrong(name, "a text", value)
        return value

    def choice(self, name: str, *choices: str) -> str | None:
        """One of some words, if one was given."""
        value = self.optional_text(name)
        if value is not None and value not in choices:
            raise _wrong(name, " or ".join(choices), value)
        return value

    def number(self, name: str, default: int, *, at_least: int, at_most: int) -> int:
        """A whole number within bounds."""
        value = self._given.get(name)
        if value is None:
            return default
        if type(value) is not int or not at_least <= value <= at_most:
            raise _wrong(name, f"a whole number from {at_least} to {at_most}", value)
        return value

    def flag(self, name: str) -> bool:
        """Whether something is wanted; not, unless it is said."""
        value = self._given.get(name, False)
        if not isinstance(value, bool):
            raise _wrong(name, "true or false", value)
        return value

    def triple(self, name: str) -> Triple | None:
        """Three finite numbers, if given.

        >>> Arguments({"xyz": [0.1, 0, 0.4]}).triple("xyz")
        (0.1, 0.0, 0.4)
        """
        value = self._given.get(name)
        if value is None:
            return None
        match value:
            case [int() | float() as x, int() | float() as y, int() | float() as z]:
                triple = float(x), float(y), float(z)
                if all(math.isfinite(number) for number in triple):
                    return triple
        raise _wrong(name, "three finite numbers", value)


def _wrong(name: str, expected: str, value: object) -> ProtocolViolation:
    found = "nothing" if value is None else repr(value)[:80]
    text = f"{name} should be {expected}, not {found}"
    return ProtocolViolation(Problem("CONTROL_ARGUMENT", text, where="control socket"))
