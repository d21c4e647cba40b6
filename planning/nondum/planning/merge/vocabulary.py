"""The types and predicates that one component declares."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from nondum.planning.merge.core import core_graph, core_predicates
from nondum.planning.merge.domain import Origin, Predicate
from nondum.planning.merge.scope import Report, Scope
from nondum.planning.pddl.caret import nearest
from nondum.planning.pddl.syntax import (
    DomainFragment,
    PredicateDeclaration,
    Term,
    TypedName,
    type_text,
)
from nondum.planning.pddl.typegraph import ROOT, TypeGraph
from nondum.sdk.frozen import frozen
from nondum.sdk.messages import MESSAGES

TYPES_LIMIT = 500
"""Types that one component may declare."""


@frozen
class TypeClaim:
    """A type and the parents claimed for it; none: no claim."""

    name: str
    parents: frozenset[str]
    origin: Origin


def types_of(domains: Sequence[DomainFragment], report: Report) -> tuple[TypeClaim, ...]:
    """The types beyond the core's (PDDL_TYPE_PARENT, PDDL_TYPE_CYCLE, PDDL_TWICE, PDDL_TOO_MANY).

    Undeclared parents are declared under `object`, with a warning.
    """
    claims: dict[str, TypeClaim] = {}
    declared = [type_ for domain in domains for type_ in domain.types]
    if len(declared) > TYPES_LIMIT:
        message = f"{len(declared)} types are declared, more than {TYPES_LIMIT}"
        report.problem("PDDL_TOO_MANY", message, declared[TYPES_LIMIT].place)
        return ()
    for type_ in declared:
        if _is_core(type_, report):
            continue
        claim = TypeClaim(type_.name, frozenset(type_.types), report.origin(type_.place))
        known = claims.setdefault(type_.name, claim)
        if known.parents != claim.parents:
            message = f"type {type_.name!r} has other parents at {known.origin.place}"
            report.problem("PDDL_TWICE", message, type_.place)
    for type_ in declared:
        for parent in sorted(set(type_.types) - claims.keys()):
            if parent not in core_graph():
                claims[parent] = TypeClaim(parent, frozenset(), report.origin(type_.place))
                fix = nearest(parent, core_graph().parents) or "declare it in :types"
                message = f"type {parent!r} is not declared; taken as an object"
                report.warning("PDDL_UNKNOWN", message, type_.place, fix)
    _check_cycle(claims, report)
    return tuple(claims.values())


def _is_core(type_: TypedName, report: Report) -> bool:
    """Whether the core has the type already. It keeps its parents: others live by them."""
    if type_.name not in core_graph():
        return False
    if type_.name == ROOT:
        check_root(type_, report)
    elif not set(type_.types) <= core_graph().ancestors(type_.name):
        parents = type_text(tuple(sorted(core_graph().parents[type_.name])))
        message = f"in the core, {type_.name!r} is a kind of {parents}"
        report.problem("PDDL_TYPE_PARENT", message, type_.place, "choose another name")
    return True


def check_root(type_: TypedName, report: Report) -> None:
    """Check that `object` is not declared below another type (PDDL_TYPE_CYCLE)."""
    if set(type_.types) - {ROOT}:
        report.problem("PDDL_TYPE_CYCLE", "'object' is above all types", type_.place)


def _check_cycle(claims: dict[str, TypeClaim], report: Report) -> None:
    cycle = TypeGraph({claim.name: claim.parents for claim in claims.values()}).cycle()
    if cycle:
        place = claims[cycle[0]].origin.place
        assert place is not None, "claims of fragments have a place"
        report.problem("PDDL_TYPE_CYCLE", f"types in a circle: {cycle_text(cycle)}", place)


def cycle_text(cycle: tuple[str, ...]) -> str:
    """Every edge of a circle of types.

    >>> cycle_text(("a", "b"))
    'a - b, b - a'
    """
    return ", ".join(f"{a} - {b}" for a, b in zip(cycle, cycle[1:] + cycle[:1], strict=True))


def predicates_of(domains: Sequence[DomainFragment], scope: Scope) -> tuple[Predicate, ...]:
    """The predicates beyond the core's (PDDL_UNKNOWN, PDDL_ARITY, PDDL_SIGNATURE)."""
    valued = _valued(domains, scope)
    functional = {name.name for name in _marked("functional", domains, scope)}
    found: dict[str, Predicate] = {}
    for declared in (predicate for domain in domains for predicate in domain.predicates):
        predicate = Predicate.declared(
            checked(declared, scope),
            scope.report.origin(declared.place),
            valued=declared.name in valued,
            value_type=valued.get(declared.name, ""),
            functional=declared.name in functional,
        )
        known = core_predicates().get(declared.name) or found.get(declared.name)
        if known is None:
            found[declared.name] = predicate
        else:
            _compare(predicate, known, declared, scope)
    return tuple(found.values())


def functions_of(domains: Sequence[DomainFragment], scope: Scope) -> tuple[Predicate, ...]:
    """The functions declared, `total-cost` included (PDDL_UNKNOWN, PDDL_TWICE)."""
    found: dict[str, Predicate] = {}
    for declared in (function for domain in domains for function in domain.functions):
        origin = scope.report.origin(declared.place)
        function = Predicate.declared(checked(declared, scope), origin)
        known = found.setdefault(declared.name, function)
        if known.parameters != function.parameters:
            message = f"function {declared.name!r} has other parameters at {known.origins[0].place}"
            scope.report.problem("PDDL_TWICE", message, declared.place)
    return tuple(found.values())


def checked(declared: PredicateDeclaration, scope: Scope) -> PredicateDeclaration:
    """A predicate or function, the types of its parameters checked (PDDL_UNKNOWN)."""
    return replace(declared, parameters=scope.checked_types(declared.parameters))


def _compare(
    predicate: Predicate, known: Predicate, declared: PredicateDeclaration, scope: Scope
) -> None:
    other = f"as {known.origins[0]} declares it"
    if predicate.arity != known.arity:
        message = f"predicate {known.name!r}: {predicate.arity} arguments, {known.arity} {other}"
        scope.report.problem("PDDL_ARITY", message, declared.place, "choose another name")
        return
    for position, (mine, theirs) in enumerate(
        zip(predicate.parameters, known.parameters, strict=True), 1
    ):
        if not scope.graph.comparable(mine, theirs):
            message = (
                f"predicate {known.name!r}, argument {position}: {type_text(mine)},"
                f" {type_text(theirs)} {other}"
            )
            scope.report.problem("PDDL_SIGNATURE", message, declared.place, "choose another name")


def _valued(domains: Sequence[DomainFragment], scope: Scope) -> dict[str, str]:
    """Valued predicate → the message type of its value, or nothing (PDDL_UNKNOWN, PDDL_TYPE)."""
    found: dict[str, str] = {}
    for name in _marked("valued", domains, scope):
        assert isinstance(name, TypedName)
        types = name.types
        if len(types) > 1 or (types and types[0] not in MESSAGES):
            message = f"the value of {name.name!r} is of no message type: {type_text(types)}"
            scope.report.problem("PDDL_TYPE", message, name.place, nearest(types[0], MESSAGES))
        else:
            found[name.name] = types[0] if types else ""
    return found


def _marked(
    section: str, domains: Sequence[DomainFragment], scope: Scope
) -> Iterator[Term | TypedName]:
    declared = {predicate.name for domain in domains for predicate in domain.predicates}
    for domain in domains:
        for name in domain.valued if section == "valued" else domain.functional:
            if name.name in declared - core_predicates().keys():
                yield name
            else:
                message = f"{name.name!r} in :{section} is no predicate that this plugin declares"
                fix = nearest(name.name, declared)
                scope.report.problem("PDDL_UNKNOWN", message, name.place, fix)
