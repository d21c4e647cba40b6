"""PDDL text into syntax, or a refusal that says where and what was expected instead."""

from __future__ import annotations

import re
from functools import lru_cache
from threading import Lock
from typing import cast

from lark import Token, UnexpectedCharacters, UnexpectedInput

from nondum.planning.pddl.build import Builder
from nondum.planning.pddl.caret import Misplaced, nearest, refusal, shown
from nondum.planning.pddl.syntax import Formula, FragmentSyntax, Place, PredicateDeclaration
from nondum.planning.pddl.tables import parser_of
from nondum.sdk.errors import FragmentRefused, Problem

SIZE_LIMIT_BYTES = 256 * 1024
DEPTH_LIMIT = 64
NAME_LIMIT = 200

_COMMENT = re.compile(r";[^\n]*")
_LONG = re.compile(rf"[^\s()]{{{NAME_LIMIT + 1},}}")
_WORD = re.compile(r"[^\s()]+|.", re.DOTALL)
_LOWER = {upper: upper + 32 for upper in range(ord("A"), ord("Z") + 1)}
_SECTIONS_NOT_HANDLED = {
    ":durative-action": "durative actions",
    ":constraints": "trajectory constraints",
    ":process": "processes",
    ":event": "events",
}
_PREFERENCE = re.compile(r"\(\s*preference\s+[^\s()]*\s*$")
_TIMED = re.compile(r"\(\s*at\s*$")
_DIGITS = re.compile(r"[0-9.]+$")
_NEGATIVE = re.compile(r"-[0-9.]+$")
_LOOK_BACK = 200
_SAID = {
    "LPAR": "'('",
    "RPAR": "')'",
    "MINUS": "'-'",
    "NAME": "a name",
    "VARIABLE": "a variable",
    "NUMBER": "a number",
    "COMPARISON": "a comparison",
    "CHANGE": "a numeric effect",
    "EQUALS": "'='",
    "$END": "the end",
}


def parse_fragment(
    text: str, file: str, *, size_limit_bytes: int = SIZE_LIMIT_BYTES
) -> FragmentSyntax:
    """Parse a whole domain or problem; `file` is the name that messages give.

    A byte order mark before it is passed over. Raises `FragmentRefused`: PDDL_SYNTAX,
    PDDL_UNSUPPORTED, PDDL_TWICE, PDDL_TOO_BIG, PDDL_TOO_DEEP.
    """
    return _parse_cached(text.removeprefix("\ufeff"), file, size_limit_bytes)


@lru_cache(maxsize=1024)
def _parse_cached(text: str, file: str, size_limit_bytes: int) -> FragmentSyntax:
    if len(text.encode()) > size_limit_bytes:
        need, have = f"at most {size_limit_bytes} bytes", f"{len(text.encode())}"
        raise FragmentRefused(Problem("PDDL_TOO_BIG", "the text is too long", file, need, have))
    return cast(FragmentSyntax, _parse(text, file, "fragment"))


def parse_formula(text: str, file: str) -> Formula:
    """Parse one condition, such as a goal. Raises `FragmentRefused` as `parse_fragment` does."""
    return cast(Formula, _parse(text, file, "formula"))


@lru_cache(maxsize=1024)
def parse_signature(text: str, file: str) -> PredicateDeclaration:
    """Parse `(name ?parameter - type …)`. Raises `FragmentRefused` as `parse_fragment` does."""
    return cast(PredicateDeclaration, _parse(text, file, "signature"))


class _Parser:
    """The grammar, prepared once."""

    def __init__(self) -> None:
        self._builder = Builder()
        self._one_at_a_time = Lock()
        self._lark = parser_of(self._builder)

    def parse(self, text: str, file: str, start: str) -> object:
        """Raises `UnexpectedInput` or `Misplaced`."""
        with self._one_at_a_time:
            self._builder.file = file
            return self._lark.parse(text, start=start)

    def pattern(self, terminal: str) -> str:
        """What a terminal matches."""
        return next(t.pattern.value for t in self._lark.terminals if t.name == terminal)


@lru_cache(maxsize=1)
def _parser() -> _Parser:
    return _Parser()


def _parse(text: str, file: str, start: str) -> object:
    clean = _COMMENT.sub(lambda comment: " " * len(comment[0]), text).translate(_LOWER)
    _check_depth(clean, text, file)
    if long := _LONG.search(clean):
        message = f"a name or number is longer than {NAME_LIMIT} characters"
        place = _place(clean, long.start(), file)
        raise FragmentRefused(refusal("PDDL_TOO_BIG", message, place, text))
    try:
        return _parser().parse(clean, file, start)
    except UnexpectedInput as error:
        raise FragmentRefused(_unexpected(error, clean, text, file)) from error
    except Misplaced as error:
        raise FragmentRefused(error.problem(text)) from error


def _check_depth(clean: str, text: str, file: str) -> None:
    depth = 0
    for bracket in re.finditer(r"[()]", clean):
        depth += 1 if bracket[0] == "(" else -1
        if depth > DEPTH_LIMIT:
            place = _place(clean, bracket.start(), file)
            message = f"brackets are nested more than {DEPTH_LIMIT} deep"
            raise FragmentRefused(refusal("PDDL_TOO_DEEP", message, place, text))


def _place(text: str, offset: int, file: str) -> Place:
    line = text.count("\n", 0, offset) + 1
    return Place(file, line, offset - (text.rfind("\n", 0, offset) + 1) + 1)


def _unexpected(error: UnexpectedInput, clean: str, text: str, file: str) -> Problem:
    is_at_end = _at_end(error)
    offset = len(clean.rstrip()) if is_at_end else cast(int, error.pos_in_stream)
    match = _WORD.match(clean, offset)
    found = match[0] if match and not is_at_end else ""
    place = _place(clean, offset, file)
    if message := _not_handled(found, clean[max(offset - _LOOK_BACK, 0) : offset]):
        return refusal("PDDL_UNSUPPORTED", message, place, text)
    expected = _expected(error)
    listed = " or ".join(expected) if len(expected) < 6 else "one of " + ", ".join(expected)
    message = f"expected {listed}, found {shown(found) if found else 'the end of the text'}"
    fix = nearest(found, (word.strip("'") for word in expected)) if len(found) > 2 else ""
    return refusal("PDDL_SYNTAX", message, place, text, fix=fix)


def _not_handled(found: str, before: str) -> str:
    """What is PDDL, but none of nondum's, said by its name."""
    if found in _SECTIONS_NOT_HANDLED:
        return f"{_SECTIONS_NOT_HANDLED[found]} are not handled"
    if _PREFERENCE.search(before):
        return "preferences are not handled"
    if _TIMED.search(before) and _DIGITS.match(found):
        return "facts that become true at a time are not handled"
    if _NEGATIVE.match(found):
        return "negative numbers are not handled"
    return ""


def _at_end(error: UnexpectedInput) -> bool:
    token = getattr(error, "token", None)
    return isinstance(token, Token) and token.type == "$END"


def _expected(error: UnexpectedInput) -> list[str]:
    """What could stand there. The parser knows; its lexer looks for more than can follow."""
    names: set[str]
    if isinstance(error, UnexpectedCharacters):
        names = error.interactive_parser.accepts()  # type: ignore[no-untyped-call]  # lark's own
    else:
        names = getattr(error, "accepts", None) or getattr(error, "expected", None) or set()
    return sorted({_said(name) for name in names if name != "_KEYWORD"})


def _said(terminal: str) -> str:
    """A terminal in a person's words; keywords are named after what they match."""
    if terminal in _SAID:
        return _SAID[terminal]
    return f"'{_parser().pattern(terminal).split('(?!')[0]}'"
