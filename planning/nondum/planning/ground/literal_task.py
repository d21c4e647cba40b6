"""The literal task: an explored domain whose conditions may still be negative literals."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from nondum.planning.ground.bounds import INSTANCES_LIMIT, Spending, work_for
from nondum.planning.ground.delete_relaxation import reachable_part
from nondum.planning.ground.expansion import Expander
from nondum.planning.ground.instances import Change, Exploration, Instance, Literals
from nondum.planning.merge.derivation import strata_of
from nondum.planning.merge.domain import Merged, bind
from nondum.planning.merge.goal import GoalExpr
from nondum.planning.pddl.facts import parts
from nondum.planning.pddl.syntax import Atom, Equal
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import ConditionalEffect, GroundAction, Layer, Rule

GOAL = "goal"
"""What stands for a goal that is a disjunction."""


@frozen
class LiteralTask:
    """A task like a ground task, but for what must be false: where a condition of it has `~number`,
    the fact of that number must not hold. Its layers have no complements."""

    init: frozenset[int]
    goal: Literals
    actions: tuple[GroundAction, ...]
    derived: tuple[Layer, ...]


def expanded(
    merged: Merged, found: Exploration, goal: GoalExpr, *, limit: int = INSTANCES_LIMIT
) -> LiteralTask:
    """Write out the quantifiers and disjunctions of everything that can be reached.

    Raises `TooManyBindings` where they speak of too much for a domain with `limit` bound actions.
    """
    return _Expansion(merged, found, limit).literal_task(goal)


class _Expansion:
    def __init__(self, merged: Merged, found: Exploration, limit: int) -> None:
        self._merged = merged
        self._found = found
        self._spending = Spending(work_for(limit))
        self._expander = Expander(found, merged.is_closed, self._spending.work)
        self._groups = strata_of(merged.domain.derived).groups

    def literal_task(self, goal: GoalExpr) -> LiteralTask:
        layers = self._layers()
        actions = [
            action for instance in self._found.instances for action in self._actions(instance)
        ]
        wanted = self._goal(goal)
        layers.append(list(self._expander.new_rules()))
        literal_task = LiteralTask(
            self._found.believed, wanted, tuple(actions), tuple(Layer(tuple(r)) for r in layers)
        )
        return reachable_part(literal_task) if self._was_expanded(goal) else literal_task

    def _was_expanded(self, goal: GoalExpr) -> bool:
        """Whether exploring could not see all conditions."""
        domain = self._merged.domain
        conditions = [goal, *(rule.condition for rule in domain.derived)]
        for action in domain.actions.values():
            conditions += (action.precondition, *(c.condition for c in action.effect.conditional))
        return any(condition.further for condition in conditions)

    def _layers(self) -> list[list[Rule]]:
        layer = {name: index for index, group in enumerate(self._groups) for name in group}
        layers: list[list[Rule]] = [[] for _ in self._groups]
        for derivation in sorted(
            self._found.derivations, key=lambda d: (d.head, *d.names.values())
        ):
            rule = derivation.rule
            further, names = rule.condition.further, derivation.names
            with self._spending.by(rule.head.predicate, rule.origins):
                bodies = self._expander.alternatives(derivation.literals, further, names)
            rules = layers[layer[rule.head.predicate]]
            rules += (Rule(derivation.head, body) for body in bodies)
            rules += self._expander.new_rules()
        return layers

    def _actions(self, instance: Instance) -> Iterator[GroundAction]:
        cost = self._cost(instance)
        if cost is None:
            return
        action = instance.action
        with self._spending.by(action.name, action.origins):
            always, changes = _sorted_out(self._changes(instance.changes))
            further = action.precondition.further
            conditions = self._expander.alternatives(instance.literals, further, instance.names)
        add = instance.add.union(*(change.add for change in always))
        delete = instance.delete.union(*(change.delete for change in always)) - add
        conditional = tuple(_net(changes, add, delete))
        for condition in conditions:
            yield GroundAction(instance.name, condition, add, delete, cost, conditional)

    def _changes(self, changes: Iterable[Change]) -> Iterator[ConditionalEffect]:
        for change in changes:
            further = change.condition.further
            for condition in self._expander.alternatives(change.literals, further, change.names):
                yield ConditionalEffect(condition, change.add, change.delete)

    def _cost(self, instance: Instance) -> int | None:
        """None where a function that it adds has no value: then it cannot be taken (PDDL 2.1)."""
        cost = instance.action.effect.cost
        for function in instance.action.effect.cost_functions:
            value = self._merged.values.get(bind(function, instance.names))
            if value is None:
                return None
            cost += value
        return cost

    def _goal(self, goal: GoalExpr) -> Literals:
        """Equal objects that differ, or different ones that do not, ask for what nothing gives."""
        wrong = [pair for pair in goal.equal if pair.left != pair.right]
        wrong += [pair for pair in goal.unequal if pair.left == pair.right]
        literals = frozenset(
            (
                *map(self._number, goal.positive),
                *map(self._pair, wrong),
                *(~self._number(atom) for atom in goal.negative),
            )
        )
        if not goal.further:
            return literals
        with self._spending.by("the goal"):
            ways = self._expander.alternatives(Literals(), goal.further, {})
        return literals | self._expander.disjunction(ways, GOAL)

    def _number(self, atom: Atom) -> int:
        return self._found.table.number(atom.predicate, tuple(term.name for term in atom.terms))

    def _pair(self, pair: Equal) -> int:
        return self._found.table.number("=", (pair.left.name, pair.right.name))


def stands_for_goal(text: str) -> bool:
    """Whether a fact of a ground task is the one that was made for a disjunctive goal.

    >>> stands_for_goal("goal 0"), stands_for_goal("goal north"), stands_for_goal("goal")
    (True, False, False)
    """
    predicate, arguments = parts(text)
    return predicate == GOAL and "".join(arguments).isdecimal()


def _sorted_out(
    changes: Iterable[ConditionalEffect],
) -> tuple[Sequence[ConditionalEffect], Sequence[ConditionalEffect]]:
    """Those that happen always, and those that happen where a condition holds."""
    found = list(dict.fromkeys(changes))
    always = [change for change in found if not change.condition]
    return always, [change for change in found if change.condition]


def _net(
    changes: Iterable[ConditionalEffect], add: frozenset[int], delete: frozenset[int]
) -> Iterator[ConditionalEffect]:
    """What the conditional changes do beside the unconditional ones."""
    merged: dict[Literals, tuple[frozenset[int], frozenset[int]]] = {}
    for change in changes:
        added, deleted = merged.get(change.condition, (frozenset(), frozenset()))
        merged[change.condition] = added | change.add, deleted | change.delete
    for condition, (added, deleted) in merged.items():
        mine = added - add
        others = deleted - added - add - delete
        if mine or others:
            yield ConditionalEffect(condition, mine, others)
