"""Of all state reasons, the one that is shown, and how long."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

from hypothesis import given
from hypothesis import strategies as st

from nondum.host.core.feedback_state import NOTHING, State, StateReason
from nondum.host.people.feedback.showing import Durations, Shown, shown, since

DURATIONS = Durations(refused_s=60, safe_s=15)
REFUSED = StateReason(State.REFUSED, "payload k", "refused", "SIG_MISSING")
WORKING = StateReason(State.WORKING, "drive a", "working")
SAFE = StateReason(State.SAFE, "drive a", "safe")
HELP = StateReason(State.HELP, "goal 1", "help")
REASONS = st.lists(
    st.builds(
        StateReason,
        st.sampled_from([s for s in State if s is not State.READY]),
        st.sampled_from(["drive a", "drive b", "goal 1"]),
        st.just("told"),
        st.sampled_from(["", "CODE"]),
    ),
    unique=True,
)


def at_once(*reasons: StateReason) -> Shown:
    return shown(reasons, since({}, reasons, 0.0), 0.0, DURATIONS)


def test_nothing_to_tell_is_ready() -> None:
    assert at_once() == Shown(NOTHING, None)


def test_the_order_of_state_reasons_does_not_matter() -> None:
    every = (REFUSED, WORKING, SAFE, HELP)
    assert {at_once(*order).reason for order in permutations(every)} == {REFUSED}
    assert {at_once(*order).reason for order in permutations(every[1:])} == {WORKING}
    assert {at_once(*order).reason for order in permutations(every[2:])} == {HELP}


def test_a_drive_that_may_be_pulled_does_not_hide_that_help_is_needed() -> None:
    known = since(since({}, [SAFE], 0.0), [SAFE, HELP], 5.0)
    assert shown([SAFE, HELP], known, 6.0, DURATIONS) == Shown(HELP, None)
    known = since(since({}, [HELP], 0.0), [SAFE, HELP], 5.0)
    both = shown([SAFE, HELP], known, 6.0, DURATIONS)
    assert (both.reason.state, both.until_s) == (State.SAFE, 20.0)
    assert HELP.sentence in both.reason.sentence
    assert shown([SAFE, HELP], known, 20.0, DURATIONS) == Shown(HELP, None)


def test_a_refusal_is_shown_for_its_time_then_what_is_behind_it() -> None:
    known = since({}, [REFUSED, HELP], 100.0)
    assert shown([REFUSED, HELP], known, 159.9, DURATIONS) == Shown(REFUSED, 160.0)
    assert shown([REFUSED, HELP], known, 160.0, DURATIONS) == Shown(HELP, None)


def test_a_refusal_is_not_shown_once_its_drive_is_pulled() -> None:
    known = since(since({}, [REFUSED], 0.0), [], 1.0)
    assert shown([], known, 1.0, DURATIONS).reason == NOTHING


def test_what_comes_again_is_news_again() -> None:
    known = since({}, [REFUSED], 0.0)
    known = since(known, [], 70.0)
    known = since(known, [REFUSED], 80.0)
    assert shown([REFUSED], known, 81.0, DURATIONS) == Shown(REFUSED, 140.0)


def test_of_two_refusals_the_newer_is_shown() -> None:
    later = StateReason(State.REFUSED, "drive b", "no payload", "DRIVE_NOT_PAYLOAD")
    known = since(since({}, [REFUSED], 0.0), [REFUSED, later], 5.0)
    assert shown([REFUSED, later], known, 6.0, DURATIONS).reason == later


@given(REASONS, st.floats(0, 1e6), st.floats(0, 1e3))
def test_what_is_shown_is_a_state_reason_and_changes_when_it_says(
    reasons: list[StateReason], began_s: float, later_s: float
) -> None:
    known = since({}, reasons, began_s)
    now = shown(reasons, known, began_s + later_s, DURATIONS)
    assert replace(now.reason, sentence="") in [
        replace(reason, sentence="") for reason in (*reasons, NOTHING)
    ]
    assert now.until_s is None or now.until_s > began_s + later_s
    if now.until_s is not None:  # then it gives way to another
        assert shown(reasons, known, now.until_s, DURATIONS).reason != now.reason


@given(REASONS)
def test_nothing_is_shown_while_something_before_it_is_new(reasons: list[StateReason]) -> None:
    order = (State.REFUSED, State.WORKING, State.HELP, State.SAFE, State.READY)
    ranks = [order.index(reason.state) for reason in reasons]
    now = at_once(*reasons).reason
    assert order.index(now.state) == min(ranks, default=order.index(State.READY))
