"""What strangers' payloads make a host say is kept short: it is journalled, told and shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

from nondum.sdk.errors import Problem

MOST_PROBLEMS = 24
MOST_CHARACTERS = 400
"""Of each part of a problem."""


def brief(problems: Sequence[Problem]) -> tuple[Problem, ...]:
    """The first of many problems, and how many more there are; long texts are cut.

    >>> [str(problem) for problem in brief([Problem("A", "a")] * 3)]
    ['A a', 'A a', 'A a']
    >>> str(brief([Problem("A", "a")] * 100)[-1])
    'A and 77 more like this → see all: `nondum payload verify DIR`'
    """
    if len(problems) <= MOST_PROBLEMS:
        return tuple(map(_cut, problems))
    shown, left = problems[: MOST_PROBLEMS - 1], problems[MOST_PROBLEMS - 1 :]
    text, fix = f"and {len(left)} more like this", "see all: `nondum payload verify DIR`"
    return *map(_cut, shown), Problem(left[0].code, text, fix=fix)


def _cut(problem: Problem) -> Problem:
    long = {
        field.name: f"{text[:MOST_CHARACTERS]}…"
        for field in fields(Problem)
        if len(text := getattr(problem, field.name)) > MOST_CHARACTERS
    }
    return replace(problem, **long) if long else problem
