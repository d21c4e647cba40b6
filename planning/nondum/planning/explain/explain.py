"""Why a goal has no plan, and which known components would help."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from nondum.planning.explain.cause import Cause, Lack
from nondum.planning.explain.conflict import Conflict, Search, conflict_of
from nondum.planning.explain.missing import Outlook
from nondum.planning.explain.tracing import Tracer
from nondum.planning.ground.delete_relaxation import reachable_facts
from nondum.planning.ground.exploration import explore
from nondum.planning.ground.literal_task import LiteralTask, expanded
from nondum.planning.ground.matching import FactIndex
from nondum.planning.ground.schema_relevance import relevant_part
from nondum.planning.merge.claims import claims_of
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.core import core_graph
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.goal import GoalExpr
from nondum.planning.pddl.facts import parts
from nondum.planning.pddl.syntax import Atom
from nondum.planning.pddl.typegraph import TypeGraph, types_or_root
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class Diagnosis:
    """Why there is no plan."""

    causes: tuple[Cause, ...]
    """What is missing. Empty: each part of the goal can be reached, if not all at once."""
    conflict: Conflict | None = None
    """Where nothing is missing: which parts of the goal exclude each other."""

    def problems(self) -> tuple[Problem, ...]:
        """The diagnosis in words, one problem for each cause."""
        if self.conflict is not None:
            return self.conflict.problems()
        return tuple(cause.problem() for cause in self.causes)


def explain(
    merged: Merged,
    facts: Iterable[str],
    goal: GoalExpr,
    objects: Mapping[str, tuple[str, ...]] | None = None,
    *,
    search: Search | None = None,
) -> Diagnosis:
    """Say why a goal has no plan; the arguments are those of `ground`.

    Only for a goal that a planner called unsolvable: of one that has a plan it says nothing true.
    `search` tells which parts of the goal exclude each other; without it, that is not said. Raises
    `FragmentRefused` as `ground` does.
    """
    believed = frozenset(facts)
    part = relevant_part(merged, goal)
    found = explore(part.merged, part.known(believed), objects)
    literal_task = expanded(part.merged, found, goal)
    reachable = FactIndex()
    for number in sorted(reachable_facts(literal_task)):
        if number >= 0:
            reachable.add(*found.table.facts[number])
    lasting = frozenset(map(found.table.text, literal_task.init - _deleted(literal_task)))
    causes = Tracer(part.merged, Outlook(reachable, lasting, found.members)).causes(goal)
    if causes:
        return Diagnosis(causes)
    return Diagnosis((), conflict_of(merged, believed, goal, objects, search))


def _deleted(literal_task: LiteralTask) -> frozenset[int]:
    deleted = {fact for action in literal_task.actions for fact in action.delete}
    for action in literal_task.actions:
        deleted.update(*(change.delete for change in action.conditional))
    return frozenset(deleted)


def suppliers(causes: Iterable[Cause], known: Iterable[Contribution]) -> tuple[Contribution, ...]:
    """The known contributions that bring an action or object which a cause says is missing."""
    wanted = tuple(causes)
    return tuple(
        contribution
        for contribution in known
        if any(_supplies(contribution, cause) for cause in wanted)
    )


def _supplies(contribution: Contribution, cause: Cause) -> bool:
    claims = claims_of(contribution)
    if claims.problems:
        return False
    graph = core_graph().with_parents({claim.name: claim.parents for claim in claims.types})
    if cause.lack is Lack.ACTION:
        effects = (
            (atom, {p.name: types_or_root(p.types) for p in action.parameters})
            for action in claims.actions
            for atom in action.effect.added()
        )
        rules = (
            (rule.head, {p.name: types_or_root(p.types) for p in rule.parameters})
            for rule in claims.derived
        )
        return any(_gives(atom, types, cause, graph) for atom, types in (*effects, *rules))
    if cause.lack is Lack.OBJECT:
        owned = {unit.type for unit in contribution.units}
        owned |= {stream.type for stream in contribution.streams}
        owned |= {type_ for claim in claims.objects for type_ in claim.types}
        return graph.is_one_of(owned, cause.types)
    return False


def _gives(
    atom: Atom, types: Mapping[str, tuple[str, ...]], cause: Cause, graph: TypeGraph
) -> bool:
    """Whether an effect may be what is missing, as far as types tell."""
    if atom.predicate != parts(cause.fact)[0]:
        return False
    return all(
        not wanted or term.name not in types or graph.may_be(types[term.name], wanted)
        for term, wanted in zip(atom.terms, cause.terms, strict=True)
    )
