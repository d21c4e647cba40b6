"""From schemas and facts to a ground task: only actions that can be reached and can help.

Static facts stay in preconditions: what the planner may take for granted, the running task must
still guard.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from nondum.planning.domain import Merged
from nondum.planning.exploration import INSTANCES_LIMIT, Instance, explore
from nondum.planning.facts import fact, twin
from nondum.planning.goal import GoalExpr
from nondum.planning.syntax import Atom, Equal
from nondum.sdk.planner import GroundAction, GroundTask


def ground(
    merged: Merged,
    facts: Iterable[str],
    goal: GoalExpr,
    objects: Mapping[str, tuple[str, ...]] | None = None,
    *,
    limit: int = INSTANCES_LIMIT,
) -> GroundTask:
    """Make the task of reaching `goal` from where exactly `facts` are true.

    `facts` are all that is believed, those of `merged.init` included where they still hold; facts
    about objects that are not there are left out. `objects` (name → types) exist beside the merged
    ones. A fact that must be false somewhere has its twin in the task (`facts.twin`). The same
    input gives the same task, whatever the order of `facts`. Raises `FragmentRefused` as `explore`
    does, for more than `limit` bound actions.
    """
    found = explore(merged, facts, objects, limit=limit)
    wanted, unwanted = _goal_facts(goal)
    helpful = _helpful(found.instances, wanted, unwanted)
    negated = unwanted.union(*(instance.negative for instance in helpful))
    mentioned = wanted.union(map(twin, negated), *(i.positive | i.add | i.delete for i in helpful))
    names = tuple(sorted(mentioned))
    number = {name: index for index, name in enumerate(names)}
    believed = (found.believed & mentioned) | {twin(f) for f in negated - found.believed}
    return GroundTask(
        facts=names,
        init=frozenset(number[name] for name in believed),
        goal=frozenset(number[name] for name in wanted.union(map(twin, unwanted))),
        actions=tuple(_action(instance, negated, number) for instance in helpful),
    )


def _goal_facts(goal: GoalExpr) -> tuple[frozenset[str], frozenset[str]]:
    """The facts that must hold and must not hold. Equal objects that differ, or different ones that
    do not, ask for a fact that nothing gives."""
    wrong = [pair for pair in goal.equal if pair.left != pair.right]
    wrong += [pair for pair in goal.unequal if pair.left == pair.right]
    wanted = {_text(atom) for atom in goal.positive} | {_pair_text(pair) for pair in wrong}
    return frozenset(wanted), frozenset(_text(atom) for atom in goal.negative)


def _text(atom: Atom) -> str:
    return fact(atom.predicate, *(term.name for term in atom.terms))


def _pair_text(pair: Equal) -> str:
    return fact("=", pair.left.name, pair.right.name)


def _helpful(
    instances: Iterable[Instance], wanted: frozenset[str], unwanted: frozenset[str]
) -> list[Instance]:
    """The instances that give something which the goal, or another helpful one, asks for."""
    givers: dict[str, list[Instance]] = {}
    for instance in instances:
        for given in (*instance.add, *map(twin, instance.delete)):
            givers.setdefault(given, []).append(instance)
    waiting = [*wanted, *map(twin, unwanted)]
    asked = set(waiting)
    helpful: dict[str, Instance] = {}
    while waiting:
        for instance in givers.get(waiting.pop(), ()):
            if instance.name not in helpful:
                helpful[instance.name] = instance
                new = {*instance.positive, *map(twin, instance.negative)} - asked
                asked |= new
                waiting += new
    return [helpful[name] for name in sorted(helpful)]


def _action(instance: Instance, negated: frozenset[str], number: Mapping[str, int]) -> GroundAction:
    add = instance.add.union(map(twin, instance.delete & negated))
    delete = instance.delete.union(map(twin, instance.add & negated))
    precondition = instance.positive.union(map(twin, instance.negative))
    return GroundAction(
        name=instance.name,
        precondition=frozenset(number[f] for f in precondition),
        add=frozenset(number[f] for f in add),
        delete=frozenset(number[f] for f in delete if f in number),
        cost=instance.cost,
    )
