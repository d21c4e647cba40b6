"""What is overdue: by its own pace, and never sooner than after a second."""

from __future__ import annotations

from functools import reduce

from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.pace import FIRST_S, LONGEST_FIRST_S, PERIODS, STALL_S, Pace

periods = st.lists(st.floats(0.001, 30.0), min_size=1, max_size=30)


def paced(*periods_s: float) -> Pace:
    return reduce(lambda pace, period_s: pace.after(pace.last_s + period_s), periods_s, Pace(0.0))


def test_after_one_nothing_is_known_yet() -> None:
    assert paced().overdue_s == FIRST_S


def test_second_one_may_take_some_times_as_long_as_the_first() -> None:
    assert Pace(8.0, first_took_s=8.0).overdue_s == 8.0 + PERIODS * 8.0
    assert Pace(900.0, first_took_s=900.0).overdue_s == 900.0 + LONGEST_FIRST_S


def test_what_comes_often_is_overdue_after_a_second() -> None:
    pace = paced(*[0.1] * 20)
    assert pace.overdue_s == pace.last_s + STALL_S


def test_what_comes_once_a_second_or_less_flows_all_the_same() -> None:
    pace = paced(2.0, 2.2, 1.9)
    assert pace.overdue_s > pace.last_s + 5.0


def test_one_late_message_is_forgotten() -> None:
    pace = paced(*[0.1] * 20, 8.0, *[0.1] * 20)
    assert pace.overdue_s == pace.last_s + STALL_S


@given(periods, st.floats(0.001, 30.0))
def test_who_keeps_the_pace_is_never_overdue(before: list[float], period_s: float) -> None:
    pace = paced(*before, period_s)
    assert pace.last_s + period_s < pace.overdue_s or period_s < STALL_S
    assert pace.overdue_s - pace.last_s <= max(STALL_S, PERIODS * max(*before, period_s)) + 1e-6
