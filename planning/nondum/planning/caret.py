"""A refusal that points at the place in the text that it is about."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

from nondum.planning.syntax import Place
from nondum.sdk.errors import Problem

_LOOKED_AT = 1000
"""How many names are compared: a fragment of nothing but mistakes must not cost minutes."""


def caret(text: str, place: Place) -> str:
    """The line of `place`, and below it a caret under its column.

    >>> print(caret("(not\\n  (at ?x))", Place("d.pddl", 2, 4)))
      (at ?x))
       ^
    """
    lines = text.splitlines()
    line = lines[place.line - 1] if place.line <= len(lines) else ""
    indent = "".join("\t" if sign == "\t" else " " for sign in line[: place.column - 1])
    return f"{line}\n{indent}^"


def refusal(
    code: str, message: str, place: Place, text: str, *, by: str = "", fix: str = ""
) -> Problem:
    """A problem at `place` in `text`; `by` names the plugin and version that wrote it."""
    where = f"{by} {place}" if by else str(place)
    return Problem(code, f"{message}\n{caret(text, place)}", where=where, fix=fix)


def nearest(name: str, known: Iterable[str]) -> str:
    """The known name that `name` probably means, as words for a person; else nothing.

    >>> nearest("redy", ["ready", "on"])
    "did you mean 'ready'?"
    """
    found = get_close_matches(name, sorted(known)[:_LOOKED_AT], n=1, cutoff=0.6)
    return f"did you mean {found[0]!r}?" if found else ""


class Misplaced(Exception):
    """Something wrong at a place, told by code that does not have the text at hand."""

    def __init__(self, code: str, message: str, place: Place, *, fix: str = "") -> None:
        super().__init__(message)
        self.code, self.message, self.place, self.fix = code, message, place, fix

    def problem(self, text: str, *, by: str = "") -> Problem:
        """The same as a value, with the line of `text` that it is about."""
        return refusal(self.code, self.message, self.place, text, by=by, fix=self.fix)
