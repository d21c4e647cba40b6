"""A transfer fills an idle link and lets others through a slow one."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.peers.placement.pace import LARGEST, LEAST, MOST, PIECES, WAIT_S, Pace


def transfer(rate: float, round_trip_s: float, rounds: int = 400) -> tuple[Pace, list[float]]:
    """A transfer over a link of `rate` bytes a second; how long each piece has waited in it."""
    pace, waited, free_s, now_s = Pace(), [], 0.0, 0.0
    under_way: list[tuple[float, int, float]] = []
    for _ in range(rounds):
        while not under_way or sum(length for _, length, _ in under_way) < pace.window:
            starts_s = max(free_s, now_s)
            waited.append(starts_s - now_s)
            free_s = starts_s + pace.piece / rate
            under_way.append((now_s, pace.piece, free_s + round_trip_s))
        asked_s, length, now_s = under_way.pop(0)
        pace.answered(length, now_s - asked_s)
    return pace, waited


def test_fast_link_is_filled() -> None:
    pace, _ = transfer(rate=100e6, round_trip_s=0.005)
    assert pace.window == MOST
    assert pace.piece == LARGEST


@pytest.mark.parametrize("rate", [60e3, 125e3, 1e6])
@pytest.mark.parametrize("round_trip_s", [0.002, 0.2])
def test_other_traffic_waits_little_on_a_slow_link(rate: float, round_trip_s: float) -> None:
    _, waited = transfer(rate, round_trip_s)
    at_least_s = LEAST / rate
    assert max(waited[50:]) <= 3 * max(WAIT_S, at_least_s)


@given(st.lists(st.floats(0.0, 10.0)))
def test_window_stays_within_its_bounds(times_s: list[float]) -> None:
    pace = Pace()
    for took_s in times_s:
        pace.answered(pace.piece, took_s)
        assert LEAST <= pace.window <= MOST
        assert LEAST // PIECES <= pace.piece <= LARGEST
