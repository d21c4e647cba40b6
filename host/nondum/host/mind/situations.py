"""The situation that a search for a plan would be in now."""

from __future__ import annotations

from nondum.host.mind.beliefs import Beliefs
from nondum.host.mind.exclusions import Exclusions
from nondum.host.mind.facts_beside import FactsBeside
from nondum.host.mind.goals import GoalQueue, urgency
from nondum.host.mind.pursued_goals import PursuedGoals
from nondum.host.mind.situation import OtherPlans, Situation


class Situations:
    """Of one mind."""

    def __init__(
        self, queue: GoalQueue, beliefs: Beliefs, pursued: PursuedGoals, exclusions: Exclusions
    ) -> None:
        self._queue, self._beliefs, self._exclusions = queue, beliefs, exclusions
        self._pursued = pursued
        self.facts_beside = FactsBeside(beliefs, pursued)
        """What holds beside goals that are pursued."""

    def of(self, goal: str, revision: int) -> Situation:
        """That of a goal, in a revision of the composition."""
        world, excluded = self._beliefs.world, self._exclusions.excluded
        return Situation(goal, revision, world.bare_facts, excluded, self.other_plans(goal))

    def other_plans(self, goal: str) -> OtherPlans:
        """The plans of other goals than this one."""
        others = [one for one in self._pursued if one.goal != goal]
        if not others:
            return OtherPlans()
        mine = urgency(self._queue[goal])
        firm = [one for one in others if urgency(self._queue[one.goal]) < mine]
        yielding = others[len(firm) :]
        return OtherPlans(
            tuple(one.reservation for one in firm),
            tuple(one.reservation for one in yielding),
            self.facts_beside.of(firm),
            self.facts_beside.of(others),
        )
