"""People are told of who is not let in, once, and only of what they can do something about."""

from __future__ import annotations

import pytest

from nondum.host.core.events.event import Event
from nondum.host.core.events.peers import PeerTurnedAway
from nondum.host.peers.rejected_hosts import RejectedHosts
from nondum.transport.peers import HostKeys, PeerKey, Reason, Refusal

KEY = HostKeys.generate().public


def refusal(reason: Reason, key: PeerKey = KEY) -> Refusal:
    return Refusal(reason, "10.77.0.9:40000", key, "why", 0.0)


@pytest.mark.parametrize(
    "reason", [Reason.UNKNOWN_KEY, Reason.DUPLICATE, Reason.ENDLESS, Reason.FLOODING]
)
def test_who_is_turned_away_again_and_again_is_told_of_once(reason: Reason) -> None:
    events: list[Event] = []
    strangers = RejectedHosts(events.append, lambda: 0.0)
    for _ in range(10):
        strangers.turned_away(refusal(reason))
    (event,) = events
    assert isinstance(event, PeerTurnedAway)
    assert event.problems[0].fix


@pytest.mark.parametrize("reason", [Reason.GARBAGE, Reason.SILENT, Reason.CROWDED])
def test_noise_is_counted_and_not_told(reason: Reason) -> None:
    events: list[Event] = []
    RejectedHosts(events.append, lambda: 0.0).turned_away(refusal(reason))
    assert not events


def test_crowd_of_strangers_is_not_told_of_one_by_one() -> None:
    events: list[Event] = []
    strangers = RejectedHosts(events.append, lambda: 0.0)
    for _ in range(100):
        strangers.turned_away(refusal(Reason.UNKNOWN_KEY, HostKeys.generate().public))
    assert 0 < len(events) < 10
