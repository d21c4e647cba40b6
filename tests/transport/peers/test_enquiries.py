"""What peers ask about others: limits, and who is told."""

from __future__ import annotations

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from nondum.transport.peers.enquiries import ASKS, KEPT_S, PROBES_PER_S, Enquiries, asks
from nondum.transport.peers.keys import PeerKey

ROVER, SCOUT, BASE = PeerKey("rover"), PeerKey("scout"), PeerKey("base")
names = st.sampled_from([ROVER, SCOUT, BASE])


def test_who_has_asked_is_told_once() -> None:
    enquiries = Enquiries()
    assert enquiries.ask(ROVER, 7, BASE, 80, 0.0)
    assert not enquiries.ask(SCOUT, 9, BASE, 88, 0.1)
    assert enquiries.answered(BASE, 80) == {ROVER: 7, SCOUT: 9}
    assert enquiries.answered(BASE, 80) == {}


def test_only_the_ping_that_was_sent_for_it_answers_a_question() -> None:
    enquiries = Enquiries()
    enquiries.ask(ROVER, 7, BASE, 80, 0.0)
    assert enquiries.answered(BASE, 88) == {}
    assert enquiries.answered(SCOUT, 80) == {}
    assert enquiries.answered(BASE, 80) == {ROVER: 7}


def test_answer_that_comes_too_late_is_told_to_none() -> None:
    enquiries = Enquiries()
    enquiries.ask(ROVER, 7, BASE, 80, 0.0)
    enquiries.ask(ROVER, 8, SCOUT, 88, KEPT_S + 1)
    assert enquiries.answered(BASE, 80) == {}


@given(st.lists(st.tuples(names, names, st.floats(0.0, 0.5)), max_size=200))
def test_peer_is_pinged_no_more_often_however_many_ask(
    asked: list[tuple[PeerKey, PeerKey, float]],
) -> None:
    enquiries, now_s = Enquiries(), 0.0
    pings: Counter[PeerKey] = Counter()
    for number, (asker, about, later) in enumerate(asked):
        now_s += later
        pings[about] += enquiries.ask(asker, number, about, number, now_s)
    for count in pings.values():
        assert count <= 1 + now_s * PROBES_PER_S


def test_one_peer_may_ask_only_so_often() -> None:
    bucket = asks()
    assert sum(bucket.take(1, 0.0) for _ in range(10_000)) == ASKS
