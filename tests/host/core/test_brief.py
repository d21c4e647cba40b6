"""However much is wrong with a payload, what is told of it stays short."""

from __future__ import annotations

from dataclasses import astuple

from hypothesis import given
from hypothesis import strategies as st

from nondum.host.core.brief import MOST_CHARACTERS, MOST_PROBLEMS, brief
from nondum.sdk.errors import Problem

TEXTS = st.text(st.characters(), max_size=2 * MOST_CHARACTERS)
"""Half letters are among them."""
PROBLEMS = st.builds(Problem, st.sampled_from(["A", "B"]), *[TEXTS] * 5)


@given(st.lists(PROBLEMS, max_size=3 * MOST_PROBLEMS))
def test_what_is_told_is_short(problems: list[Problem]) -> None:
    told = brief(problems)
    assert len(told) == min(len(problems), MOST_PROBLEMS)
    assert all(len(text) <= MOST_CHARACTERS + 1 for p in told for text in astuple(p))
    assert {problem.code for problem in told} <= {problem.code for problem in problems}
    assert bool(told) == bool(problems)
    assert all(text.encode() is not None for p in told for text in astuple(p))


def test_what_is_short_is_told_as_it_is() -> None:
    problems = tuple(Problem("A", f"{number}", fix="do") for number in range(MOST_PROBLEMS))
    assert brief(problems) == problems
