"""What is kept of goals: those that are not over, for a daemon that starts to go on with."""

from __future__ import annotations

from typing import cast

from nondum.host.core.events.goals import GoalEnded, GoalGiven, GoalReached
from nondum.host.core.records.goal import GoalRecord
from nondum.host.lifecycle.turn import Turn
from nondum.planning.merge.goal import GoalKind


def on_goal_given(turn: Turn, event: GoalGiven) -> None:
    """Keep a goal."""
    turn.events.append(event)
    kind = cast(GoalKind, event.kind)
    goal = GoalRecord(event.goal, event.text, event.pddl, kind, event.priority)
    turn.change(goals={**turn.state.goals, goal.id: goal})


def on_goal_over(turn: Turn, event: GoalReached | GoalEnded) -> None:
    """Forget a goal that was reached, halted or replaced."""
    turn.events.append(event)
    kept = {id: goal for id, goal in turn.state.goals.items() if id != event.goal}
    turn.change(goals=kept)
