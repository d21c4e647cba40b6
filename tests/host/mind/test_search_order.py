"""Which goal a plan is searched for next."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.mind.goals import GivenGoal
from nondum.host.mind.search_order import Turns


def goals(*numbers: int) -> list[GivenGoal]:
    return [GivenGoal(str(n), "words", "(goal)", "achieve", 0, n) for n in numbers]


def nexts(turns: Turns, due: Sequence[GivenGoal], times: int) -> list[str]:
    """Whose turn it is, when each search ends before the next turn."""
    found = (turns.next(due, None, ()) for _ in range(times))
    return [goal.id for goal in found if goal is not None]


def test_most_urgent_goal_goes_first_and_then_each_has_its_turn() -> None:
    assert nexts(Turns(), goals(7, 3, 5), 6) == ["7", "3", "5", "7", "3", "5"]


def test_what_is_searched_for_makes_way_for_a_more_urgent_one_that_had_no_turn() -> None:
    turns, (urgent, other) = Turns(), goals(1, 2)
    assert turns.next([other], None, ()) == other
    assert turns.next([urgent, other], other, ()) == urgent


def test_what_is_searched_for_does_not_make_way_for_one_that_had_its_turn() -> None:
    turns, (urgent, other) = Turns(), goals(1, 2)
    assert nexts(turns, [urgent, other], 2) == ["1", "2"]
    assert turns.next([urgent, other], other, ()) == other


@pytest.mark.parametrize(("broken", "first"), [(("1",), "1"), ((), "2")])
def test_goal_that_has_lost_its_plan_waits_for_no_turn(broken: tuple[str, ...], first: str) -> None:
    turns, (urgent, other) = Turns(), goals(1, 2)
    turns.next([urgent], None, ())
    chosen = turns.next([urgent, other], None, broken)
    assert chosen is not None
    assert chosen.id == first


def test_new_knowledge_begins_with_the_most_urgent() -> None:
    turns = Turns()
    assert nexts(turns, goals(1, 2, 3), 2) == ["1", "2"]
    turns.restart()
    assert nexts(turns, goals(1, 2, 3), 1) == ["1"]


def test_nothing_is_due() -> None:
    assert Turns().next([], None, ()) is None


@given(st.lists(st.integers(1, 9), unique=True, min_size=1), st.integers(0, 9))
def test_no_goal_waits_longer_than_one_round(numbers: list[int], begun: int) -> None:
    turns, due = Turns(), goals(*numbers)
    nexts(turns, due, begun)
    assert set(nexts(turns, due, 2 * len(due))) == {goal.id for goal in due}
