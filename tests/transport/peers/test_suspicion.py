"""When a silent peer is suspected, and when it is given up: as pure values."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.transport.peers.heartbeat import beat_s
from nondum.transport.peers.suspicion import Awake, Terms, Verdict, Watched

TERMS = Terms()
LOOK_S = 0.01
beats = st.sampled_from([0.0, 0.3, 0.6, 1.8, 5.4, 1e9])
steps = st.floats(0.001, 3.0)
words = st.lists(
    st.one_of(
        st.tuples(st.just("look"), steps), st.tuples(st.sampled_from(["received", "vouched"]))
    ),
    max_size=60,
)


@given(words, beats)
def test_peer_is_given_up_only_if_it_was_asked_and_silent_since(
    told: list[tuple[object, ...]], beat: float
) -> None:
    """Whatever comes in whatever order, and however often."""
    watched, now_s, heard_s, asked_s = Watched(0.0), 0.0, 0.0, None
    for what, *more in told:
        match what:
            case "received":
                watched, heard_s, asked_s = watched.received(now_s), now_s, None
                assert watched.look(now_s, TERMS, beat) == (watched, Verdict.HEARD)
            case "vouched":
                watched = watched.vouched()
            case _:
                now_s += float(str(more[0]))
                watched, verdict = watched.look(now_s, TERMS, beat)
                if verdict is Verdict.ASK:
                    assert asked_s is None
                    assert now_s - heard_s >= TERMS.suspect_s(beat)
                    asked_s = now_s
                elif verdict is Verdict.DEAD:
                    assert asked_s is not None
                    assert now_s - asked_s >= TERMS.confirm_s(beat) - 1e-9
                    return


@given(beats, st.lists(st.floats(0.0, 0.98), min_size=1, max_size=30))
def test_peer_that_answers_in_time_when_it_is_asked_is_never_given_up(
    beat: float, lateness: list[float]
) -> None:
    """Even if it never sends anything unasked."""
    watched, now_s = Watched(0.0), 0.0
    for late in lateness:
        now_s = watched.due_s(TERMS, beat)
        watched, verdict = watched.look(now_s, TERMS, beat)
        assert verdict is Verdict.ASK
        now_s += late * TERMS.confirm_s(beat)
        watched, verdict = watched.look(now_s, TERMS, beat)
        assert verdict is Verdict.WAIT
        watched = watched.received(now_s)


@given(beats, st.lists(st.integers(0, 2000), max_size=20))
def test_dead_peer_is_given_up_within_its_limit_whatever_helpers_say(
    beat: float, vouched_at: list[int]
) -> None:
    watched, looks = Watched(0.0), 0
    while True:
        looks += 1
        watched, verdict = watched.look(looks * LOOK_S, TERMS, beat)
        if verdict is Verdict.DEAD:
            break
        for _ in range(vouched_at.count(looks)):
            watched = watched.vouched()
    limit_s = TERMS.limit_s(beat) + (TERMS.confirm_s(beat) if watched.is_vouched else 0.0)
    assert limit_s - LOOK_S <= looks * LOOK_S <= limit_s + 3 * LOOK_S


def test_word_of_a_helper_counts_once_and_only_while_a_peer_is_suspected() -> None:
    fine = Watched(5.0)
    assert fine.vouched() == fine
    suspected, verdict = fine.look(5.8, TERMS, 0.3)
    assert verdict is Verdict.ASK
    once = suspected.vouched()
    assert once.due_s(TERMS, 0.3) == pytest.approx(5.8 + 1.2)
    assert once.vouched() == once
    assert once.received(6.0) == Watched(6.0)


@given(st.lists(st.floats(0.0, 1000.0), max_size=50))
def test_time_in_which_the_own_loop_stood_still_does_not_count(gaps: list[float]) -> None:
    awake, now_s = Awake(at_s=7.0, longest_s=0.45), 7.0
    for gap in gaps:
        now_s += gap
        before = awake.seconds
        assert awake.read(now_s) == pytest.approx(awake.look(now_s).seconds, abs=1e-5)
        awake = awake.look(now_s)
        assert 0.0 <= awake.seconds - before <= min(gap, 0.45) + 1e-5


def test_peer_that_sent_just_before_a_long_stall_is_not_suspected_after_it() -> None:
    awake = Awake(at_s=0.0, longest_s=0.45).look(0.3)
    watched = Watched(awake.seconds)
    awake = awake.look(3600.0)
    assert watched.look(awake.seconds, TERMS, 0.3)[1] is Verdict.HEARD


@pytest.mark.parametrize(
    ("hosts", "bound_s"), [(2, 1.5), (32, 1.5), (100, 5.0)], ids=lambda value: str(value)
)
def test_death_is_found_within_the_bound_for_so_many_hosts(hosts: int, bound_s: float) -> None:
    assert TERMS.limit_s(beat_s(hosts - 1)) < bound_s


@given(beats)
def test_host_doubts_before_any_peer_has_given_it_up(beat: float) -> None:
    first_s = min(TERMS.limit_s(beat), max(1.0, min(3.3 * beat, 10.0)))
    assert TERMS.doubt_s(beat) < first_s


@given(st.integers(0, 2000))
def test_larger_fleet_is_pinged_no_more_often_and_in_whole_steps(links: int) -> None:
    assert beat_s(links) <= beat_s(links + 1)
    assert beat_s(links) / 0.3 == pytest.approx(round(beat_s(links) / 0.3))
    assert links / beat_s(links) <= 110
