"""While a host is there that cannot be let in for its name, every status says so; then no more."""

from __future__ import annotations

from nondum.host.peers.name_conflicts import RECENT_S, NameConflicts
from nondum.sdk.errors import Problem
from nondum.transport.discovery import Hint, Source
from nondum.transport.peers import DialFailed, HostKeys, PeerKey, PeerUp, Reason, Refusal

TAKEN = Problem("PEER_NAME_TAKEN", "two hosts are called base", where="base", fix="rename one")
KEY = HostKeys.generate().public


class Look:
    """Name conflicts, with an injected clock and network."""

    def __init__(self) -> None:
        self.now_s, self.hinted = 0.0, set[PeerKey]()
        self.called = "base"
        self.name_conflicts = NameConflicts("rover", lambda: self.now_s, self.hints)

    def hints(self) -> list[Hint]:
        at = ("tcp://10.77.0.9:7410",)
        return [Hint(key, self.called, 1, at, Source.MULTICAST) for key in self.hinted]

    def codes(self) -> list[str]:
        return [problem.code for problem in self.name_conflicts.problems]


def turned_away(problem: Problem = TAKEN) -> Refusal:
    return Refusal(Reason.DUPLICATE, "10.77.0.9:40000", KEY, str(problem), 0.0, problem)


def test_host_that_is_turned_away_for_its_name_is_told_while_it_dials() -> None:
    look = Look()
    look.name_conflicts.on_fleet(turned_away())
    look.now_s = RECENT_S
    assert look.codes() == ["PEER_NAME_TAKEN"]
    look.now_s += 1
    assert look.codes() == []


def test_host_that_turns_this_one_away_for_its_name_is_told_while_it_is_announced() -> None:
    look = Look()
    look.hinted.add(KEY)
    look.name_conflicts.on_fleet(DialFailed(KEY, "tcp://10.77.0.9:7410", TAKEN))
    look.now_s = 2 * RECENT_S  # what fails again in the same way is not told again
    assert look.codes() == ["PEER_NAME_TAKEN"]
    look.hinted.clear()
    assert look.codes() == []


def test_host_that_has_another_name_now_is_told_no_more() -> None:
    look = Look()
    look.name_conflicts.on_fleet(turned_away())
    look.name_conflicts.on_fleet(PeerUp(KEY, "mule", 1, "tcp://10.77.0.9:7410", "pairing"))
    assert look.codes() == []


def test_other_refusals_are_no_matter_of_names() -> None:
    look = Look()
    look.name_conflicts.on_fleet(
        turned_away(Problem("PEER_DUPLICATE", "an old connection came late"))
    )
    assert look.codes() == []


def test_stranger_of_the_own_name_is_told_while_it_is_announced() -> None:
    look = Look()
    look.hinted |= {KEY, HostKeys.generate().public}
    assert look.codes() == []
    look.called = "rover"
    assert look.codes() == ["PEER_NAME_TAKEN"]
    look.hinted.clear()
    assert look.codes() == []


def test_host_that_was_not_let_in_is_not_told_twice() -> None:
    look = Look()
    look.called = "rover"
    look.hinted.add(KEY)
    look.name_conflicts.on_fleet(turned_away())
    assert look.codes() == ["PEER_NAME_TAKEN"]
