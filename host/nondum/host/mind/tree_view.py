"""The behaviour tree as plain data: where each node is, and why it is there.

Every node is a row of `name`, `kind` (the class of node), `status`, `why` and `children`; some have
more: `memory` and `policy` say how composites tick, `task` is about a plan, `step` about one step.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.composites import Parallel, Selector, Sequence

from nondum.host.mind.component_leaf import ComponentLeaf
from nondum.host.mind.composition import Composition
from nondum.host.mind.goals import GoalQueue
from nondum.host.mind.pursued import Pursued
from nondum.host.mind.pursuit import Pursuit
from nondum.host.mind.runner import BehaviourRunner
from nondum.planning.execute.choice import Alternatives
from nondum.planning.execute.partial_order import GOAL, CausalLink
from nondum.planning.execute.step_status import StepStatus
from nondum.planning.execute.task_tree import StepLeaf, TaskTree
from nondum.planning.pddl.facts import parts
from nondum.sdk.planner import GroundAction

Row = dict[str, Any]

MOST_ALTERNATIVES = 5
"""How many other ways of doing a step are shown."""


class TreeView:
    """Draws one tree after the other from the same mind."""

    def __init__(
        self,
        *,
        queue: GoalQueue,
        pursuit: Pursuit,
        runner: BehaviourRunner,
        composition: Callable[[], Composition | None],
        now_s: Callable[[], float],
        wall_s: Callable[[], float],
    ) -> None:
        """`now_s` is the clock that the tree is ticked with, `wall_s` gives seconds since 1970."""
        self._queue = queue
        self._pursuit = pursuit
        self._runner = runner
        self._composition = composition
        self._now_s = now_s
        self._wall_s = wall_s
        self._choices: tuple[TaskTree, tuple[tuple[GroundAction, ...], ...]] | None = None

    def row(self, node: Behaviour) -> Row:
        """A node and all below it."""
        why = getattr(node, "why", None)
        row: Row = {
            "name": node.name,
            "kind": type(node).__name__,
            "status": node.status.value,
            "why": why() if why else node.feedback_message,
        }
        if isinstance(node, Selector | Sequence):
            row["memory"] = node.memory
        elif isinstance(node, Parallel):
            row["policy"] = type(node.policy).__name__
        elif isinstance(node, TaskTree):
            row["task"] = self._task(node)
        elif isinstance(node, StepLeaf):
            row["step"] = self._step(node)
        elif isinstance(node, ComponentLeaf):
            row["behaviour"] = {"component": node.component, "behaviour": node.behaviour}
        return row | {"children": [self.row(child) for child in node.children]}

    # A plan

    def _task(self, tree: TaskTree) -> Row:
        control = tree.control
        row: Row = {
            "phase": control.phase.value,
            "steps": len(tree.steps),
            "left": control.rest.steps.bit_count(),
            "excluded": sorted(self._pursuit.exclusions.excluded),
        }
        if one := self._pursued(tree):
            goal = self._queue[one.goal]
            row |= {"id": goal.id, "goal": goal.pddl, "text": goal.text, "kind": goal.kind}
            row["cost"] = one.plan.cost
        return row

    def _pursued(self, tree: TaskTree) -> Pursued | None:
        return next((one for one in self._pursuit.pursued if one.tree is tree), None)

    # A step

    def _step(self, leaf: StepLeaf) -> Row:
        where, action = leaf.where(), leaf.step.action
        run = next((run for run in self._runner if run.step.name == leaf.step.name), None)
        return {
            "number": leaf.index + 1,
            "action": action.name,
            "schema": action.schema,
            "arguments": self._arguments(action),
            "component": self._component(leaf.step.actor),
            "lasting": leaf.step.lasting,
            "state": where.state.value,
            "progress": run.progress if run else "",
            **self._times(where),
            "waits_for": self._waits_for(leaf, where),
            "after": _after(leaf),
            "needed_by": [self._need(leaf, link) for link in where.needed_by],
            "guard": sorted(leaf.step.guard),
            "locks": self._locks(leaf, where),
            "chosen": self._chosen(leaf),
        }

    def _arguments(self, action: GroundAction) -> dict[str, str]:
        composition = self._composition()
        try:
            if composition is not None:
                return composition.merged.bound(action)
        except KeyError:  # its plugin has gone
            pass
        return {f"argument-{n}": name for n, name in enumerate(action.arguments, start=1)}

    def _component(self, unit: str) -> str | None:
        composition = self._composition()
        found = composition.merged.objects.get(unit) if composition else None
        return (found.component or None) if found else None

    def _times(self, where: StepStatus) -> Row:
        """When it was started, and ended if it has; and for how long it has run."""
        if where.started_s is None:
            return {"started": None, "ended": None, "runs_s": None}
        now_s, wall_s = self._now_s(), self._wall_s()
        end_s = now_s if where.ended_s is None else where.ended_s
        return {
            "started": wall_s - (now_s - where.started_s),
            "ended": None if where.ended_s is None else wall_s - (now_s - where.ended_s),
            "runs_s": end_s - where.started_s,
        }

    def _waits_for(self, leaf: StepLeaf, where: StepStatus) -> list[Row]:
        """Facts that earlier steps are to give, then earlier steps that are to be over."""
        steps = leaf.control.regression.steps
        rows: list[Row] = [
            {"fact": link.fact, **_step_named(steps[link.provider].name, link.provider)}
            for link in where.lacks
            if link.provider is not None
        ]
        giving = {link.provider for link in where.lacks}
        rows += [
            {"fact": None, **_step_named(steps[index].name, index)}
            for index in where.after
            if index not in giving
        ]
        return rows

    def _need(self, leaf: StepLeaf, link: CausalLink) -> Row:
        if link.consumer == GOAL:
            return {"fact": link.fact, "step": None, "action": None}
        name = leaf.control.regression.steps[link.consumer].name
        return {"fact": link.fact, **_step_named(name, link.consumer)}

    def _locks(self, leaf: StepLeaf, where: StepStatus) -> Row:
        """What no other step has meanwhile: a unit that serves one behaviour, and facts."""
        unit = leaf.step.actor if where.exclusive else None
        return {"unit": unit, "takes": list(where.takes)}

    # Why this one

    def _chosen(self, leaf: StepLeaf) -> Row:
        action = leaf.step.action
        others = self._other_choices(leaf)
        excluded = self._excluded_for(leaf)
        return {
            "why": _why_kept(leaf, others) or _why_chosen(action, others, excluded),
            "cost": action.cost,
            "rank": self._rank(leaf.step.actor),
            "instead_of": [self._alternative(other) for other in others[:MOST_ALTERNATIVES]],
            "excluded": excluded,
        }

    def _alternative(self, action: GroundAction) -> Row:
        unit = next(iter(action.arguments), "")
        row: Row = {"action": action.name, "component": self._component(unit)}
        return row | {"cost": action.cost, "rank": self._rank(unit)}

    def _rank(self, unit: str) -> int | None:
        """The place of a unit's component: the smaller wins where two contradict each other."""
        composition, name = self._composition(), self._component(unit)
        everyone = composition.snapshot.everyone() if composition else ()
        return next((c.rank for _, c in everyone if c.id == name), None)

    def _other_choices(self, leaf: StepLeaf) -> tuple[GroundAction, ...]:
        tree, composition = leaf.parent, self._composition()
        if not isinstance(tree, TaskTree) or composition is None:
            return ()
        if self._choices is None or self._choices[0] is not tree:
            one = self._pursued(tree)
            if one is None:
                return ()
            found = Alternatives(one.task, lambda name: _kind(composition, name))
            self._choices = tree, found.of_plan(tree.control.regression)
        return self._choices[1][leaf.index]

    def _excluded_for(self, leaf: StepLeaf) -> list[str]:
        """Actions that failed too often, and would give something that is needed of this step."""
        composition = self._composition()
        if composition is None:
            return []
        needed = {parts(link.fact)[0] for link in leaf.where().needed_by}
        actions = composition.merged.domain.actions
        return [
            name
            for name in sorted(self._pursuit.exclusions.excluded)
            if (schema := name.split(" ")[0]) in actions
            and needed & {atom.predicate for atom in actions[schema].effect.added()}
        ]


def _kind(composition: Composition, name: str) -> Hashable:
    """Units and streams stand for each other where they are of one type; nothing else does."""
    found = composition.merged.objects.get(name)
    if found is None or not found.component:
        return name
    return tuple(type_.rpartition(".")[2] for type_ in found.types)


def _after(leaf: StepLeaf) -> list[int]:
    """The numbers of the steps that it comes right after in the plan, whether they are left."""
    order = leaf.control.regression.order
    return [index + 1 for index in order.last_of(order.before[leaf.index])]


def _step_named(action: str, index: int) -> Row:
    return {"step": index + 1, "action": action}


def _why_kept(leaf: StepLeaf, others: tuple[GroundAction, ...]) -> str:
    """Why a step goes on though another way would be cheaper, or nothing."""
    cost, begun_s = leaf.step.action.cost, leaf.where().started_s
    if not others or cost <= others[0].cost or begun_s is None:
        return ""
    cheapest = others[0].cost
    return f"it costs {cost}, not {cheapest}, but a running plan is not preempted for that"


def _why_chosen(action: GroundAction, others: tuple[GroundAction, ...], excluded: list[str]) -> str:
    if not others:
        return "the only one left that could do it" if excluded else "nothing else could do it"
    cheapest = others[0].cost
    if action.cost < cheapest:
        return f"the cheapest: it costs {action.cost}, others {cheapest} or more"
    if action.cost == cheapest:
        return f"as cheap as any: it costs {action.cost}"
    return f"it costs {action.cost}, not {cheapest}, but the whole plan is what is compared"
