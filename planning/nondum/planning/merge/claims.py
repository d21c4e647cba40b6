"""What one component says, checked by itself: the part of a merge that needs no one else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.core import core_graph, core_predicates
from nondum.planning.merge.derivation import derived_of
from nondum.planning.merge.domain import Action, DerivedRule, Origin, Predicate
from nondum.planning.merge.execution import behaviours_of
from nondum.planning.merge.inventory import (
    FactClaim,
    ObjectClaim,
    ValueClaim,
    facts_of,
    objects_of,
    own_objects,
    values_of,
)
from nondum.planning.merge.schema import schema_of
from nondum.planning.merge.scope import Report, Scope, TooManyProblems
from nondum.planning.merge.vocabulary import TypeClaim, functions_of, predicates_of, types_of
from nondum.planning.pddl.parse import parse_fragment
from nondum.planning.pddl.syntax import DomainFragment, FragmentSyntax, ProblemFragment
from nondum.sdk.errors import FragmentRefused, Problem


@dataclass(frozen=True, slots=True)
class Claims:
    """One component's fragments, names resolved. With problems, the rest is empty."""

    contribution: Contribution
    types: tuple[TypeClaim, ...] = ()
    predicates: tuple[Predicate, ...] = ()
    objects: tuple[ObjectClaim, ...] = ()
    actions: tuple[Action, ...] = ()
    facts: tuple[FactClaim, ...] = ()
    derived: tuple[DerivedRule, ...] = ()
    functions: tuple[Predicate, ...] = ()
    values: tuple[ValueClaim, ...] = ()
    problems: tuple[Problem, ...] = ()
    warnings: tuple[Problem, ...] = ()


@lru_cache(maxsize=4096)
def claims_of(contribution: Contribution) -> Claims:
    """Parse and check one contribution; its problems at once, up to `PROBLEMS_LIMIT`."""
    by = Origin(contribution.component, contribution.plugin, contribution.version)
    report = Report(by, {fragment.name: fragment.text for fragment in contribution.fragments})
    try:
        claims = _claims(contribution, report)
    except TooManyProblems:
        claims = Claims(contribution)
    return Claims(contribution, problems=tuple(report.problems)) if report.problems else claims


def _claims(contribution: Contribution, report: Report) -> Claims:
    fragments = _parsed(contribution, report)
    domains = [fragment for fragment in fragments if isinstance(fragment, DomainFragment)]
    types = types_of(domains, report)
    if report.problems:
        return Claims(contribution)
    graph = core_graph().with_parents({claim.name: claim.parents for claim in types})
    scope = Scope(report, contribution.host, contribution.local_names(), graph)
    scope.predicates.update(core_predicates())
    predicates = predicates_of(domains, scope)
    scope.predicates.update({predicate.name: predicate for predicate in predicates})
    functions = functions_of(domains, scope)
    scope.functions.update({function.name: function for function in functions})
    scope.objects.update(own_objects(contribution, scope))
    objects = objects_of(fragments, scope)
    scope.objects.update({claim.name: claim.types for claim in objects})
    return Claims(
        contribution=contribution,
        types=types,
        predicates=predicates,
        objects=objects,
        actions=_actions(domains, contribution, scope),
        facts=facts_of(fragments, scope),
        derived=derived_of(domains, scope),
        functions=functions,
        values=values_of(fragments, scope),
        warnings=tuple(report.warnings),
    )


def _parsed(contribution: Contribution, report: Report) -> list[FragmentSyntax]:
    fragments: list[FragmentSyntax] = []
    for fragment in contribution.fragments:
        try:
            parsed = parse_fragment(fragment.text, fragment.name)
        except FragmentRefused as refused:
            report.problems.extend(report.signed(problem) for problem in refused.problems)
            continue
        if isinstance(parsed, ProblemFragment) and parsed.goal is not None:
            message = "a fragment has no goal: people give goals"
            report.problem("PDDL_GOAL", message, parsed.goal.place, "declare a phrase for the goal")
        fragments.append(parsed)
    return fragments


def _actions(
    domains: Sequence[DomainFragment], contribution: Contribution, scope: Scope
) -> tuple[Action, ...]:
    declared = [action for domain in domains for action in domain.actions]
    first = {action.name: action for action in reversed(declared)}
    for action in declared:
        if action is not first[action.name]:
            message = f"action {action.name!r} is declared twice, first at"
            scope.report.problem(
                "PDDL_TWICE", f"{message} {first[action.name].place}", action.place
            )
    behaviours = behaviours_of(contribution, first, scope.report)
    schemas = (
        schema_of(action, contribution.plugin, behaviours.get(action.name), scope)
        for action in first.values()
    )
    return tuple(schema for schema in schemas if schema)
