"""A back-chained tree: PA-BT (Colledanchise, Almeida and Ögren, ICRA 2019; Colledanchise and
Ögren, "Behavior Trees in Robotics and AI", 2018, chapter 7).

The tree begins as the goal's conditions in sequence. Whenever it fails, the first failed condition
(breadth first) that is not expanded is: a fallback of the condition and, for each action that adds
it, a sequence of the action's preconditions and the action. Where such an action would break a
condition to the left of the new subtree, or of a subtree that it is part of, that subtree moves
left of the condition.
"""

from __future__ import annotations

from collections import deque

from benchmarks.execution.executors import Executor, Verdict, planned, verdict
from benchmarks.execution.leaves import Act, Check
from benchmarks.execution.robot import SimulatedRobot
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite, Selector, Sequence

from nondum.planning.execute.step import Step
from nondum.sdk.planner import Plan

MOST_NODES = 600


class Backchained:
    """Grows from the actions of a plan: which action to take for a condition is then no question,
    and the tree stays small. It asks for another plan where nothing is left to expand."""

    given_up: tuple[str, ...] = ()

    def __init__(self, robot: SimulatedRobot, plan: Plan, before: Executor | None) -> None:
        robot.halt_all()
        self._robot = robot
        self._steps = list({step.name: step for step in planned(robot, plan)}.values())
        self._expanded: set[Behaviour] = set()
        self._nodes = 0
        goal = [self._condition(fact) for fact in sorted(robot.scene.goal)]
        self.tree = Sequence("goal", memory=False, children=goal)

    def tick(self) -> Verdict:
        """Tick, and grow for as long as the tree fails and can."""
        while (said := verdict(self.tree)) is Verdict.NEEDS_PLAN:
            failed = self._first_failed()
            if failed is None or self._nodes > MOST_NODES:
                break
            self._expand(failed)
        return said

    def _condition(self, fact: str) -> Check:
        self._nodes += 1
        return Check(self._robot, frozenset({fact}))

    def _first_failed(self) -> Check | None:
        """The first failed condition, breadth first, that some action of the plan could mend."""
        waiting = deque[Behaviour]([self.tree])
        while waiting:
            node = waiting.popleft()
            if node.status is not Status.FAILURE:
                continue
            if isinstance(node, Check) and node not in self._expanded and self._adders(node):
                return node
            waiting.extend(node.children)
        return None

    def _adders(self, condition: Check) -> list[Step]:
        return [step for step in self._steps if condition.facts <= step.add]

    def _expand(self, condition: Check) -> None:
        steps, parent = self._adders(condition), condition.parent
        assert isinstance(parent, Composite)  # conditions stand in sequences
        place = parent.children.index(condition)
        parent.remove_child(condition)
        self._expanded.add(condition)
        ways = [self._way(step) for step in steps]
        grown = Selector(condition.name, memory=False, children=[condition, *ways])
        parent.insert_child(grown, place)
        for step in steps:
            settle(grown, step.delete)

    def _way(self, step: Step) -> Sequence:
        needs = [self._condition(fact) for fact in sorted(step.precondition)]
        self._nodes += 2
        return Sequence(step.name, memory=False, children=[*needs, Act(self._robot, step)])


def settle(grown: Behaviour, broken: frozenset[str]) -> None:
    """Move a subtree, or the ones that it is part of, left of conditions that it would break."""
    node: Behaviour = grown
    while isinstance(parent := node.parent, Composite):
        if isinstance(parent, Sequence):
            place = parent.children.index(node)
            threatened = [i for i in range(place) if holds_for(parent.children[i]) & broken]
            if threatened:
                parent.children.insert(threatened[0], parent.children.pop(place))
        node = parent


def holds_for(node: Behaviour) -> frozenset[str]:
    """What a child of a sequence is there for."""
    if isinstance(node, Selector):
        return holds_for(node.children[0])
    return node.facts if isinstance(node, Check) else frozenset()
