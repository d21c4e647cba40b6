"""A refusal that points at the place in the text that it is about."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches

from nondum.planning.pddl.syntax import Place
from nondum.sdk.errors import Problem

_LOOKED_AT = 1000
"""How many names are compared: a fragment of nothing but mistakes must not cost minutes."""
_LINE_SHOWN = 160
"""Of a longer line only what stands around the place is shown."""
_BEFORE = 60
_UNSEEN = re.compile("[\x00-\x08\x0a-\x1f\x7f-\xa0\u2028\u2029\ufeff]")
"""Signs that take no place in a terminal, or two lines, or look like blanks that PDDL knows."""
_NAME_SHOWN = 40


def caret(text: str, place: Place) -> str:
    """The line of `place`, and below it a caret under its column.

    >>> print(caret("(not\\n  (at ?x))", Place("d.pddl", 2, 4)))
      (at ?x))
       ^
    """
    lines = text.removeprefix("\ufeff").split("\n", place.line)
    line = lines[place.line - 1].rstrip("\r") if place.line <= len(lines) else ""
    line = _UNSEEN.sub("\N{REPLACEMENT CHARACTER}", line)
    column = place.column - 1
    if len(line) > _LINE_SHOWN:
        cut = max(column - _BEFORE, 0)
        before, after = "…" * (cut > 0), "…" * (cut + _LINE_SHOWN < len(line))
        line = f"{before}{line[cut : cut + _LINE_SHOWN]}{after}"
        column += len(before) - cut
    indent = "".join("\t" if sign == "\t" else " " for sign in line[:column])
    return f"{line}\n{indent}^"


def shown(name: str) -> str:
    """A name as messages give it: quoted, and cut where it is longer than any name should be.

    >>> shown("ready")
    "'ready'"
    """
    return repr(name if len(name) <= _NAME_SHOWN else f"{name[:_NAME_SHOWN]}…")


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
