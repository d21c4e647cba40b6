"""goal.txt: a few plain lines, or a refusal that says where."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse.format import goals

WORDS = st.text("abcäö xyz,-", min_size=1, max_size=30).map(str.strip).filter(bool)


def refused(data: bytes) -> list[tuple[str, str]]:
    with pytest.raises(PayloadRefused) as error:
        goals.parse(data, "goal.txt")
    return [(problem.code, problem.where) for problem in error.value.problems]


def test_a_goal_stands_on_each_line() -> None:
    text = "# in the morning\n\n  follow me \r\nsearch for people\n"
    assert goals.parse(text.encode(), "goal.txt") == ("follow me", "search for people")


@given(st.lists(WORDS, min_size=1, max_size=goals.MAX_GOALS))
def test_goals_come_back_as_they_were_written(wanted: list[str]) -> None:
    assert goals.parse(goals.to_bytes(wanted), "goal.txt") == tuple(wanted)


@given(st.binary(max_size=1200))
def test_noise_is_bounded_or_refused(data: bytes) -> None:
    try:
        found = goals.parse(data, "goal.txt")
    except PayloadRefused:
        return
    assert 1 <= len(found) <= goals.MAX_GOALS
    assert all(line.isprintable() and len(line) <= goals.MAX_CHARACTERS for line in found)


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", [("GOAL_FILE", "goal.txt")]),
        (b"# nothing\n \n", [("GOAL_FILE", "goal.txt")]),
        (b"go\n" * 9, [("GOAL_FILE", "goal.txt")]),
        (b"go\n" + b"a" * 201, [("GOAL_FILE", "goal.txt:2")]),
        (b"g\x1bo\n\ng\x00\n", [("GOAL_FILE", "goal.txt:1"), ("GOAL_FILE", "goal.txt:3")]),
        ("go \u202e back".encode(), [("GOAL_FILE", "goal.txt:1")]),
        (b"\xff", [("NOT_UTF8", "goal.txt")]),
        (b"#" * 1025, [("TOO_LARGE", "goal.txt")]),
    ],
    ids=["empty", "comments", "nine", "long", "control", "direction", "not UTF-8", "too large"],
)
def test_what_is_no_goal_is_refused_with_its_place(
    data: bytes, told: list[tuple[str, str]]
) -> None:
    assert refused(data) == told


def test_the_longest_that_is_allowed_is_allowed() -> None:
    assert goals.parse(b"a" * goals.MAX_CHARACTERS, "goal.txt") == ("a" * goals.MAX_CHARACTERS,)
    assert len(goals.parse(b"go\n" * goals.MAX_GOALS, "goal.txt")) == goals.MAX_GOALS
    goals.parse(b"go\n" + b"#" * (goals.MAX_BYTES - 3), "goal.txt")
