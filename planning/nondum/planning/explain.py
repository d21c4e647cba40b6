"""Why a goal has no plan, and which known components would help."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from nondum.planning.claims import claims_of
from nondum.planning.contribution import Contribution
from nondum.planning.core import TAKEN_PREDICATES, core_graph
from nondum.planning.domain import Merged
from nondum.planning.exploration import explore
from nondum.planning.facts import parts
from nondum.planning.goal import GoalExpr
from nondum.planning.ground import ground
from nondum.planning.matching import Pattern
from nondum.planning.tracing import Cause, Lack, Tracer, distinct
from nondum.sdk.errors import Problem
from nondum.sdk.planner import GroundTask


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Why there is no plan."""

    causes: tuple[Cause, ...]
    """What is missing. Empty: each part of the goal can be reached, if not all at once."""
    contested: tuple[str, ...] = ()
    """Resources (`free …`, `idle …`) that more than one step would take."""

    def problems(self) -> tuple[Problem, ...]:
        """The diagnosis in words, one problem for each cause."""
        if self.causes:
            return tuple(cause.problem() for cause in self.causes)
        message = "all that is needed is here, but not at the same time"
        if not self.contested:
            return (Problem("WHY_NOT_TOGETHER", message),)
        wanted = ", ".join(f"({text})" for text in self.contested)
        fix = "ask for one after the other, or bring another of the kind"
        return (Problem("WHY_NOT_TOGETHER", f"{message}; wanted twice: {wanted}", fix=fix),)


def explain(
    merged: Merged,
    facts: Iterable[str],
    goal: GoalExpr,
    objects: Mapping[str, tuple[str, ...]] | None = None,
) -> Diagnosis:
    """Say why a goal has no plan; the arguments are those of `ground`.

    Only for a goal that a planner called unsolvable: of one that has a plan it says nothing true.
    """
    believed = frozenset(facts)
    found = explore(merged, believed, objects)
    types = {name: thing.types for name, thing in merged.objects.items()} | dict(objects or {})
    tracer = Tracer(merged, types, found.reachable)
    causes: list[Cause] = []
    for atom in goal.positive:
        wanted = Pattern(atom.predicate, tuple(term.name for term in atom.terms))
        if " ".join((wanted.predicate, *wanted.terms)) not in found.reachable:
            causes += tracer.roots(wanted)
    if causes:
        return Diagnosis(distinct(causes))
    return Diagnosis((), _contested(ground(merged, believed, goal, objects)))


def _contested(task: GroundTask) -> tuple[str, ...]:
    """The resources that more than one action of the task takes."""
    takers = Counter(index for action in task.actions for index in action.delete)
    return tuple(
        task.facts[index]
        for index, count in sorted(takers.items())
        if count > 1 and parts(task.facts[index])[0] in TAKEN_PREDICATES
    )


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
    if cause.lack is Lack.ACTION:
        predicate, _ = parts(cause.fact)
        added = (atom.predicate for action in claims.actions for atom in action.effect.added())
        return not claims.problems and predicate in added
    if cause.lack is Lack.OBJECT:
        graph = core_graph().with_parents({claim.name: claim.parents for claim in claims.types})
        owned = {unit.type for unit in contribution.units}
        owned |= {stream.type for stream in contribution.streams}
        owned |= {type_ for claim in claims.objects for type_ in claim.types}
        return not claims.problems and graph.is_one_of(owned, cause.types)
    return False
