"""Which goals are kept for the daemon's next life."""

from __future__ import annotations

from nondum.host.core.events.event import Event
from nondum.host.core.events.goals import GoalEnded, GoalGiven, GoalReached
from nondum.host.core.events.peers import PeerJoined, PeerLeft
from nondum.host.core.records.goal import GoalRecord
from nondum.host.core.records.moment import Moment
from nondum.host.core.state import HostState
from nondum.host.lifecycle.advance import advance
from nondum.host.lifecycle.recovery import recover

AT = Moment(1.0, 2.0)
GIVEN = GoalGiven("1", "follow me", "maintain", "(following rover person)", 3)
OTHER = GoalGiven("2", "report", "achieve", "(reported person rover)")


def after(*events: Event) -> HostState:
    state = HostState("rover")
    for event in events:
        outcome = advance(state, event, AT)
        assert outcome.events == (event,)
        assert outcome.state.revision == state.revision
        state = outcome.state
    return state


def test_given_goals_are_kept_whole() -> None:
    goal = GoalRecord("1", "follow me", "(following rover person)", "maintain", 3)
    assert after(GIVEN, OTHER).snapshot().goals[0] == goal


def test_goals_that_are_over_are_not_kept() -> None:
    assert list(after(GIVEN, OTHER, GoalReached("2")).goals) == ["1"]
    assert not after(GIVEN, GoalEnded("1", "halted by a person"), GoalEnded("9", "unknown")).goals


def test_host_is_at_work_for_a_goal_or_a_peer() -> None:
    assert not HostState("rover").is_at_work
    assert after(GIVEN).is_at_work
    assert not after(GIVEN, GoalEnded("1", "halted by a person")).is_at_work
    state = advance(HostState("rover"), PeerJoined("key", "scout", "", "pairing", "1"), AT).state
    assert state.is_at_work
    assert not advance(state, PeerLeft("key", "scout", "its process ended"), AT).state.is_at_work


def test_goals_survive_recovery() -> None:
    state = after(GIVEN)
    assert recover(state, AT).state.goals == state.goals
