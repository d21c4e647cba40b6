"""What the last tick of a goal's tree came to: noted in the goal, and told to people."""

from __future__ import annotations

from collections.abc import Callable

from nondum.host.core.events.event import Emit
from nondum.host.core.events.goals import GoalReached
from nondum.host.mind.announcements import People
from nondum.host.mind.beliefs import Beliefs
from nondum.host.mind.goals import GoalQueue, GoalState
from nondum.host.mind.pursued import Pursued
from nondum.planning.execute.plan_executive import Phase


class Conclusions:
    """Draws them for the goals of one mind."""

    def __init__(
        self,
        queue: GoalQueue,
        beliefs: Beliefs,
        people: People,
        emit: Emit,
        now_s: Callable[[], float],
    ) -> None:
        self._queue, self._beliefs, self._people = queue, beliefs, people
        self._emit, self._now_s = emit, now_s

    def draw(self, one: Pursued) -> bool:
        """Note and tell how a goal stands. Says whether it is reached, and no longer pursued."""
        control = one.tree.control
        if not control.decisions:  # not ticked yet
            return False
        phase = control.phase
        if phase is not one.phase:
            one.phase, one.trouble = phase, ""
            self._tell_phase(one, phase)
        for name in control.proven(self._now_s()):
            control.attempts.effective(name)
        if phase is Phase.UNDER_WAY and (trouble := control.trouble()) != one.trouble:
            one.trouble = trouble
            self._queue.put(one.goal, GoalState.ACTIVE, trouble)
        if phase is not Phase.REACHED:
            return False
        goal = self._queue.put(one.goal, GoalState.REACHED, control.answer or "it holds")
        if goal.kind == "do":  # the next time that it is asked for, it is done again
            self._beliefs.world.withdraw_effects(control.regression.goal)
        self._emit(GoalReached(one.goal))
        return True

    def _tell_phase(self, one: Pursued, phase: Phase) -> None:
        goal = self._queue[one.goal]
        if phase is Phase.REACHED:
            answer = one.tree.control.answer
            told = f"{goal.text}: {answer}" if answer else f"goal {goal.id} is reached: {goal.text}"
            self._people.tell(told)
        elif phase is Phase.HOLDING:
            self._queue.put(goal.id, GoalState.ACTIVE, "it holds and is kept so")
            self._people.tell(f"goal {goal.id} holds and is kept so: {goal.text}")
        elif phase is Phase.UNDER_WAY:
            self._queue.put(goal.id, GoalState.ACTIVE, "")
        elif why := one.tree.needs_replan:
            self._queue.put(goal.id, GoalState.ACTIVE, f"another plan is needed: {why}")
            self._people.tell(f"goal {goal.id} needs another plan: {why}")
