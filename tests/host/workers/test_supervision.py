"""Three restarts in a minute, each after a longer wait; then no more."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from nondum.host.workers.supervision import RESTARTS, WINDOW_S, Supervision

TIMES = st.lists(st.floats(0.0, 1000.0), max_size=40).map(sorted)


def after(times: list[float]) -> Supervision:
    state = Supervision()
    for at_s in times:
        state = state.crashed(at_s)
    return state


def test_waits_grow_until_it_is_exhausted() -> None:
    state = Supervision()
    delays = []
    for at_s in (0.0, 2.0, 5.0, 10.0):
        state = state.crashed(at_s)
        delays.append((state.delay_s, state.is_exhausted))
    assert delays == [(1.0, False), (2.0, False), (4.0, False), (8.0, True)]


def test_a_good_minute_forgives() -> None:
    state = after([0.0, 1.0, 2.0, 2.0 + WINDOW_S])
    assert not state.is_exhausted
    assert state.delay_s == 1.0


@given(TIMES)
def test_exhausted_means_too_many_in_one_window(times: list[float]) -> None:
    recent = [at_s for at_s in times if times[-1] - at_s < WINDOW_S]
    assert after(times).is_exhausted == (len(recent) > RESTARTS)
