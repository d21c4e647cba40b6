"""Payloads that may make a goal harder to reach by being there.

More components mean more facts, objects and actions, so what a smaller set can do a greater one can
do too; unless something must be false, holds of everything, or happens under a condition.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from nondum.planning.explain.advise.relevance import Sketch, sketch_of
from nondum.planning.ground.schema_relevance import relevant_part
from nondum.planning.merge.claims import claims_of
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import DerivedRule, Merged
from nondum.planning.merge.goal import GoalExpr
from nondum.planning.pddl.normal import Condition, atoms_in
from nondum.planning.pddl.syntax import And, Formula, Not, Or, Quantified, TypedName
from nondum.planning.pddl.typegraph import types_or_root


def disturbers(
    merged: Merged, goal: GoalExpr, brought: Sequence[tuple[int, tuple[Contribution, ...]]]
) -> frozenset[int]:
    """Those of the numbered payloads without which there may be a plan although with all of them
    there is none. Empty: no part of them can do what all of them cannot."""
    part = relevant_part(merged, goal).merged
    sensitive, types = _sensitive(part, goal)
    graph = merged.domain.types

    def disturbs(contribution: Contribution) -> bool:
        sketch: Sketch = sketch_of(contribution)
        heads = {rule.head.predicate for rule in claims_of(contribution).derived}
        if sensitive & (sketch.facts | heads):
            return True
        return bool(types) and any(graph.is_one_of(of, types) for _, of in sketch.objects)

    return frozenset(number for number, group in brought if any(map(disturbs, group)))


def _sensitive(part: Merged, goal: GoalExpr) -> tuple[set[str], set[str]]:
    """The predicates of which more facts may do harm, and the types of which more objects may."""
    actions = part.domain.actions.values()
    changes = [change for action in actions for change in action.effect.conditional]
    conditions = [goal, *(action.precondition for action in actions)]
    conditions += [change.condition for change in changes]
    conditions += [rule.condition for rule in part.domain.derived]
    predicates = {p for condition in conditions for p, is_true in _atoms(condition) if not is_true}
    predicates |= {p for change in changes for p, _ in _atoms(change.condition)}
    variables = [variable for change in changes for variable in change.variables]
    variables += (v for c in conditions for v in _quantified(c, ("forall",)))
    for rule in _feeding(part, predicates):
        variables += rule.parameters
        variables += _quantified(rule.condition, ("forall", "exists"))
    return predicates, {type_ for v in variables for type_ in types_or_root(v.types)}


def _feeding(part: Merged, predicates: set[str]) -> list[DerivedRule]:
    """The rules that such facts follow from; what they read is added to `predicates`."""
    found: list[DerivedRule] = []
    left = list(part.domain.derived)
    while new := [rule for rule in left if rule.head.predicate in predicates]:
        found += new
        left = [rule for rule in left if rule not in new]
        predicates |= {p for rule in new for p, _ in _atoms(rule.condition)}
    return found


def _atoms(condition: Condition) -> Iterator[tuple[str, bool]]:
    for formula in condition.parts():
        for atom, is_true in atoms_in(formula):
            yield atom.predicate, is_true


def _quantified(condition: Condition, quantifiers: Iterable[str]) -> Iterator[TypedName]:
    wanted = frozenset(quantifiers)
    for formula in condition.further:
        yield from _variables(formula, wanted)


def _variables(formula: Formula, quantifiers: frozenset[str]) -> Iterator[TypedName]:
    match formula:
        case And() | Or():
            for part in formula.parts:
                yield from _variables(part, quantifiers)
        case Not():
            yield from _variables(formula.part, quantifiers)
        case Quantified():
            if formula.quantifier in quantifiers:
                yield from formula.variables
            yield from _variables(formula.part, quantifiers)
