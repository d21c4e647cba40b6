"""The goal queue: who goes first, and who makes way."""

from __future__ import annotations

import pytest
from tests.kit.golden import Golden

from nondum.host.core.records.goal import GoalRecord
from nondum.host.mind.goals import GoalQueue, GoalState
from nondum.planning.merge.goal import GoalKind
from nondum.sdk.errors import GoalRefused


def give(queue: GoalQueue, kind: GoalKind = "achieve", priority: int = 0) -> str:
    return queue.give("words", "(goal)", kind, priority=priority).id


@pytest.fixture
def queue() -> GoalQueue:
    return GoalQueue()


def wanted(queue: GoalQueue) -> str | None:
    return next((goal.id for goal in queue.open()), None)


def test_higher_priority_goes_first(queue: GoalQueue) -> None:
    give(queue)
    assert wanted(queue) == "1"
    give(queue, priority=1)
    assert wanted(queue) == "2"


def test_what_can_be_finished_goes_before_what_never_ends(queue: GoalQueue) -> None:
    give(queue, "maintain")
    give(queue)
    give(queue)
    assert wanted(queue) == "2"


def test_newest_wish_to_maintain_wins(queue: GoalQueue) -> None:
    give(queue, "maintain")
    give(queue, "maintain")
    assert wanted(queue) == "2"


def test_words_that_are_kept_wait_and_count_as_given_when_they_were_said(queue: GoalQueue) -> None:
    kept = queue.keep("follow me")
    later = give(queue, "maintain")
    assert wanted(queue) == later
    queue.give("follow me", "(followed)", "maintain", id=kept.id)
    assert [goal.id for goal in queue] == [kept.id, later]
    assert wanted(queue) == later
    queue.put(later, GoalState.HALTED)
    assert wanted(queue) == kept.id


def test_goals_that_people_gave_can_be_resumed_while_they_are_halted(queue: GoalQueue) -> None:
    ours, payloads = give(queue), queue.give("words", "(goal)", "achieve", id="org.example/1").id
    assert not queue[ours].is_resumable
    for id in (ours, payloads):
        queue.put(id, GoalState.HALTED)
    assert (queue[ours].is_resumable, queue[payloads].is_resumable) == (True, False)


def test_suspended_goal_keeps_its_place(queue: GoalQueue) -> None:
    first = give(queue, priority=1)
    give(queue)
    queue.put(first, GoalState.SUSPENDED, "no way")
    assert [goal.id for goal in queue.open()] == ["1", "2"]


def test_newer_goal_to_maintain_replaces_an_older_one_that_is_in_its_way(
    queue: GoalQueue, golden: Golden
) -> None:
    old, new = give(queue, "maintain"), give(queue, "maintain")
    queue.put_aside(old, new, "the base")
    assert queue[old].state is GoalState.HALTED
    golden.check("a newer goal is in its way", queue[old].reason, new=new)


def test_goal_put_aside_waits_its_turn_and_tells_for_what(queue: GoalQueue, golden: Golden) -> None:
    old, new = give(queue, "maintain"), give(queue, priority=1)
    queue.put(old, GoalState.ACTIVE)
    queue.put_aside(old, new, "the base")
    assert queue[old].state is GoalState.QUEUED
    golden.check("a more urgent goal needs the same", queue[old].reason, new=new)


def test_what_is_over_stays_over(queue: GoalQueue) -> None:
    id = give(queue)
    queue.put(id, GoalState.REACHED)
    queue.put(id, GoalState.ACTIVE)
    assert queue[id].state is GoalState.REACHED
    assert wanted(queue) is None


def test_unknown_goal_is_refused_with_those_known(queue: GoalQueue) -> None:
    give(queue)
    with pytest.raises(GoalRefused, match="goals: 1"):
        queue["7"]


def test_old_ends_are_forgotten(queue: GoalQueue) -> None:
    for _ in range(200):
        queue.put(give(queue), GoalState.REACHED)
    assert len(list(queue)) < 60


def test_goals_of_an_earlier_run_keep_their_ids_and_order(queue: GoalQueue) -> None:
    kept = [
        GoalRecord("7", "follow me", "(following rover person)", "maintain", 1),
        GoalRecord("4", "report", "(reported person rover)", "achieve", 0),
    ]
    queue.restore(kept)
    queue.restore(kept)
    assert [(g.id, g.text, g.kind, g.priority) for g in queue] == [
        ("7", "follow me", "maintain", 1),
        ("4", "report", "achieve", 0),
    ]
    assert {goal.state for goal in queue} == {GoalState.QUEUED}
    newer = queue[give(queue)]
    assert int(newer.id) > 7
    assert all(newer.number > goal.number for goal in queue if goal is not newer)


def test_goal_says_which_it_replaces_before_it_has_a_plan_and_after(queue: GoalQueue) -> None:
    first, other = give(queue, "maintain"), give(queue)
    second = give(queue, "maintain")
    assert [goal.id for goal in queue.replaces(second)] == [first]
    assert not queue.replaces(first)
    assert not queue.replaces(other)
    queue.put_aside(first, second)
    queue.put(second, GoalState.ACTIVE)
    assert [goal.id for goal in queue.replaces(second)] == [first]
    third = give(queue, "maintain")
    assert [goal.id for goal in queue.replaces(third)] == [second]
    queue.put(third, GoalState.ACTIVE)  # both can be had
    assert not queue.replaces(third)


def test_goal_that_is_resumed_was_replaced_by_none(queue: GoalQueue) -> None:
    first, second = give(queue, "maintain"), give(queue, "maintain")
    queue.put_aside(first, second)
    queue.put(second, GoalState.ACTIVE)
    queue.give("words", "(goal)", "maintain", id=first)
    assert [goal.id for goal in queue.replaces(first)] == [second]
    assert not queue.replaces(second)
