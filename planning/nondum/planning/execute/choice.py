"""What else a step's part could be played by: other units' actions that give facts of its kind."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import TypeAlias

from nondum.planning.execute.regression import Regression
from nondum.planning.pddl.facts import parts
from nondum.sdk.planner import GroundAction, GroundTask

Kind: TypeAlias = Callable[[str], Hashable]
"""What an object is, so that facts about two of a kind can stand for each other: its types."""
Shape: TypeAlias = tuple[str, tuple[Hashable, ...]]
Player: TypeAlias = tuple[str, str]
"""Schema and actor."""


class Alternatives:
    """The actions of a task by what they give."""

    def __init__(self, task: GroundTask, kind: Kind) -> None:
        self._task = task
        self._kind = kind
        self._shapes = [self._shape(fact) for fact in task.facts]
        self._givers: defaultdict[Shape, list[GroundAction]] = defaultdict(list)
        for action in task.actions:
            for shape in {self._shapes[fact] for fact in action.add}:
                self._givers[shape].append(action)

    def of_plan(self, regression: Regression) -> tuple[tuple[GroundAction, ...], ...]:
        """For each step of a plan in this task, the cheapest action of each other unit (and
        schema) that could give what is needed of the step; cheapest first."""
        playing = {_player(step.action) for step in regression.steps}
        return tuple(
            tuple(self._alternatives(regression, index, playing))
            for index in range(len(regression.steps))
        )

    def _alternatives(
        self, regression: Regression, index: int, playing: set[Player]
    ) -> Sequence[GroundAction]:
        found: dict[Player, GroundAction] = {}
        for action in self._giving(regression, index):
            player = _player(action)
            if player in playing:
                continue
            if player not in found or action.cost < found[player].cost:
                found[player] = action
        return sorted(found.values(), key=lambda action: (action.cost, action.name))

    def _giving(self, regression: Regression, index: int) -> Iterator[GroundAction]:
        for shape in {self._shape(link.fact) for link in regression.uses_of(index)}:
            yield from self._givers[shape]

    def _shape(self, fact: str) -> Shape:
        predicate, arguments = parts(fact)
        return predicate, tuple(map(self._kind, arguments))


def _player(action: GroundAction) -> Player:
    return action.schema, action.arguments[0] if action.arguments else ""
