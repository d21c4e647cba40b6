"""How far another host's clock is ahead, from answers that took their time."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.transport.streams.clocks import Clocks

DELAYS = st.floats(0.0, 0.5)


def test_nothing_is_known_at_first() -> None:
    assert Clocks().ahead_s == 0.0


def test_one_clock_for_both_is_exact() -> None:
    clocks = Clocks()
    clocks.pong_received(sent_s=10.0, owner_s=10.0004, now_s=10.001)
    assert clocks.ahead_s == 0.0


@given(st.floats(10.0, 1e6), st.lists(st.tuples(DELAYS, DELAYS), min_size=1, max_size=20))
def test_error_is_no_more_than_half_the_quickest_answer(
    ahead_s: float, ways: list[tuple[float, float]]
) -> None:
    clocks = Clocks()
    for number, (there_s, back_s) in enumerate(ways):
        sent_s = 50.0 + number
        clocks.pong_received(sent_s, sent_s + there_s + ahead_s, sent_s + there_s + back_s)
    quickest_s = min(there_s + back_s for there_s, back_s in ways)
    drift_s = 2e-4 * len(ways)
    assert clocks.ahead_s == pytest.approx(ahead_s, abs=quickest_s / 2 + drift_s + 1e-6)


def test_old_answers_give_way_as_clocks_drift() -> None:
    clocks = Clocks()
    clocks.pong_received(0.0, 1000.0005, 0.001)
    clocks.pong_received(100.0, 1100.026, 100.002)
    assert clocks.ahead_s == pytest.approx(1000.025, abs=1e-3)
