"""What strangers' payloads make a host say is kept short: it is journalled, told and shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

from nondum.sdk.errors import Problem

MOST_PROBLEMS = 24
MOST_CHARACTERS = 400
"""Of each part of a problem."""


def brief(problems: Sequence[Problem]) -> tuple[Problem, ...]:
    """The first of many problems, and how many more there are; long texts are cut, and what is no
    letter is told by its number.

    >>> [str(problem) for problem in brief([Problem("A", "a")] * 3)]
    ['A a', 'A a', 'A a']
    >>> str(brief([Problem("A", "a")] * 100)[-1])
    'A and 77 more like this → see all: `nondum payload verify DIR`'
    >>> brief([Problem("A", "half a letter: \\ud83e")])[0].message
    'half a letter: \\\\ud83e'
    """
    if len(problems) <= MOST_PROBLEMS:
        return tuple(map(_short, problems))
    shown, left = problems[: MOST_PROBLEMS - 1], problems[MOST_PROBLEMS - 1 :]
    text, fix = f"and {len(left)} more like this", "see all: `nondum payload verify DIR`"
    return *map(_short, shown), Problem(left[0].code, text, fix=fix)


def _short(problem: Problem) -> Problem:
    said = {field.name: _text(getattr(problem, field.name)) for field in fields(Problem)}
    return replace(problem, **said)


def _text(text: str) -> str:
    """Neither UTF-8 nor the catalogue has half letters, which JSON and names of files may have."""
    whole = text.encode("utf-8", "backslashreplace").decode()
    return whole if len(whole) <= MOST_CHARACTERS else f"{whole[:MOST_CHARACTERS]}…"
