"""What a value must be beyond its type: `Annotated[T, check]`. A check raises `Mismatch`.

Annotated[int, Bounds(1, 64)]      a number from 1 to 64
Annotated[str, Bounds(1, 64)]      a text of 1 to 64 characters; bytes and tuples likewise
Annotated[str, matching(PATTERN)]  a text that matches as a whole
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from nondum.sdk.frozen import frozen


class Mismatch(ValueError):
    """Plain data is not what its type says. A caller that reads data of strangers raises an error
    with a code in its place."""

    def __init__(self, reason: str, place: str = "") -> None:
        super().__init__(f"{place}: {reason}" if place else reason)
        self.reason = reason
        self.place = place
        """Where in the data: `.units[3].name`."""

    def within(self, place: str) -> Mismatch:
        """The same, seen from outside of a place."""
        return Mismatch(self.reason, place + self.place)


@frozen
class Bounds:
    """What a number, or the length of anything else, is at least and at most."""

    least: float
    most: float

    def __call__(self, value: Any) -> None:
        """Raise `Mismatch` for a value that is out of bounds."""
        is_number = isinstance(value, int | float)
        if not self.least <= (value if is_number else len(value)) <= self.most:
            raise self.mismatch(
                value if is_number else len(value), "number" if is_number else "length"
            )

    def mismatch(self, found: float, measure: str) -> Mismatch:
        """The reason why."""
        return Mismatch(
            f"expected a {measure} from {self.least} to {self.most}, found {found!r:.40}"
        )


def matching(pattern: re.Pattern[str]) -> Callable[[str], None]:
    """Check that a whole text matches a pattern."""

    def check(value: str) -> None:
        if not pattern.fullmatch(value):
            raise Mismatch(f"expected a text like {pattern.pattern}, found {value!r:.40}")

    return check
