"""What one component says, checked by itself: the part of a merge that needs no one else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.core import core_graph, core_predicates
from nondum.planning.merge.derivation import derived_of
from nondum.planning.merge.domain import Action, DerivedRule, Origin, Predicate
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
from nondum.planning.pddl.caret import nearest
from nondum.planning.pddl.parse import parse_fragment, parse_signature
from nondum.planning.pddl.syntax import (
    ActionDeclaration,
    DomainFragment,
    FragmentSyntax,
    ProblemFragment,
    TypedName,
)
from nondum.planning.pddl.typegraph import types_or_root
from nondum.sdk.description import Behaviour
from nondum.sdk.errors import FragmentRefused, Problem
from nondum.sdk.frozen import frozen


@frozen
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
    behaviours = _behaviours_of(contribution, first, scope.report)
    schemas = (
        schema_of(action, contribution.plugin, behaviours.get(action.name), scope)
        for action in first.values()
    )
    return tuple(schema for schema in schemas if schema)


def _behaviours_of(
    contribution: Contribution, actions: Mapping[str, ActionDeclaration], report: Report
) -> dict[str, Behaviour]:
    """Action → the behaviour that carries it out; none where behaviours are not known.

    Adds PDDL_BEHAVIOUR for a behaviour without its action, an action without a behaviour, two
    behaviours for one action, and parameters that differ.
    """
    if contribution.behaviours is None:
        return {}
    found: dict[str, Behaviour] = {}
    for behaviour in contribution.behaviours:
        name = _action_name(behaviour, actions, report)
        if name in found:
            message = f"behaviours {found[name].name!r} and {behaviour.name!r} carry out {name!r}"
            _refuse(behaviour, message, report)
        elif name:
            found[name] = behaviour
    for action in actions.values():
        if action.name not in found:
            message = f"no behaviour carries out action {action.name!r}"
            report.problem(
                "PDDL_BEHAVIOUR", message, action.place, "decorate the function that does"
            )
    return found


def _action_name(
    behaviour: Behaviour, actions: Mapping[str, ActionDeclaration], report: Report
) -> str:
    try:
        signature = parse_signature(behaviour.action, f"behaviour {behaviour.name}")
    except FragmentRefused as refused:
        report.problems.extend(report.signed(problem) for problem in refused.problems)
        return ""
    action = actions.get(signature.name)
    if action is None:
        message = f"no fragment declares its action {signature.name!r}"
        _refuse(behaviour, message, report, nearest(signature.name, actions))
        return ""
    if _plain(signature.parameters) != _plain(action.parameters):
        declared = " ".join(map(str, action.parameters))
        message = f"its action is {behaviour.action}, {action.place} has ({declared})"
        _refuse(behaviour, message, report, "use the same names and types, in the same order")
    return signature.name


def _plain(parameters: tuple[TypedName, ...]) -> list[tuple[str, tuple[str, ...]]]:
    return [(p.name, tuple(sorted(types_or_root(p.types)))) for p in parameters]


def _refuse(behaviour: Behaviour, message: str, report: Report, fix: str = "") -> None:
    where = f"{report.by} behaviour {behaviour.name!r}"
    report.problems.append(Problem("PDDL_BEHAVIOUR", message, where=where, fix=fix))
