"""The objects and facts that one component declares."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from nondum.planning.merge.contribution import Contribution, StreamObject, UnitObject
from nondum.planning.merge.domain import Origin, bind
from nondum.planning.merge.effect import is_exact
from nondum.planning.merge.scope import OWNED_MARK, Scope
from nondum.planning.pddl.caret import nearest
from nondum.planning.pddl.syntax import (
    Atom,
    DomainFragment,
    Formula,
    FragmentSyntax,
    Numeric,
    ProblemFragment,
    TypedName,
    type_text,
)
from nondum.planning.pddl.typegraph import ROOT, TypeGraph, types_or_root
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class ObjectClaim:
    """A shared object and the types claimed for it."""

    name: str
    types: tuple[str, ...]
    origin: Origin


@frozen
class ValueClaim:
    """A number given to a function of objects."""

    function: str
    """`distance hall kitchen`."""
    value: int
    origin: Origin


@frozen
class FactClaim:
    """A fact of a problem fragment."""

    fact: str
    origin: Origin


def own_objects(contribution: Contribution, scope: Scope) -> dict[str, tuple[str, ...]]:
    """The component's units, streams and host, with their types (PDDL_UNKNOWN, PDDL_TYPE)."""
    found: dict[str, tuple[str, ...]] = {contribution.host: ("host",)}
    for unit in contribution.units:
        _check_kind(unit, unit.local, "unit", scope)
        found[unit.object] = (unit.type,)
    for stream in contribution.streams:
        _check_kind(stream, stream.slot, "stream", scope)
        found[stream.object] = (stream.type,)
    return found


def _check_kind(owned: UnitObject | StreamObject, local: str, kind: str, scope: Scope) -> None:
    where = f"{scope.report.by} {kind} {local!r}"
    scope.report.problems.extend(kind_problems(owned.type, kind, where, scope.graph))


def kind_problems(type: str, kind: str, where: str, graph: TypeGraph) -> Iterator[Problem]:
    """What is wrong with a type that is to be a kind of another one (PDDL_UNKNOWN, PDDL_TYPE)."""
    if type not in graph:
        fix = nearest(type, graph.parents)
        yield Problem("PDDL_UNKNOWN", f"type {type!r} is not declared", where=where, fix=fix)
    elif not graph.is_kind_of(type, kind):
        yield Problem("PDDL_TYPE", f"type {type!r} is not a kind of {kind}", where=where)


def objects_of(fragments: Sequence[FragmentSyntax], scope: Scope) -> tuple[ObjectClaim, ...]:
    """The shared objects declared (PDDL_UNKNOWN, PDDL_OWNED, PDDL_OBJECT_TYPE, PDDL_TWICE)."""
    claims: dict[str, ObjectClaim] = {}
    for declared in scope.checked_types(_declarations(fragments)):
        types = types_or_root(declared.types)
        name = scope.resolve(declared.name)
        if name in scope.objects:
            _check_own(declared, types, scope.objects[name], scope)
        elif OWNED_MARK in name:
            _refuse_foreign(name, declared, scope)
        else:
            claim = ObjectClaim(name, types, scope.report.origin(declared.place))
            known = claims.setdefault(name, claim)
            if known.types != types:
                message = f"{name!r} is {type_text(known.types)} at {known.origin.place}"
                scope.report.problem("PDDL_TWICE", message, declared.place)
    return tuple(claims.values())


def _declarations(fragments: Sequence[FragmentSyntax]) -> Iterator[TypedName]:
    for fragment in fragments:
        if isinstance(fragment, DomainFragment):
            yield from fragment.constants
        else:
            yield from fragment.objects


def _check_own(
    declared: TypedName, types: tuple[str, ...], own: tuple[str, ...], scope: Scope
) -> None:
    if types != (ROOT,) and not scope.graph.all_kind_of(own, types):
        message = f"{declared.name!r} is {type_text(own)}, not {type_text(types)}"
        scope.report.problem("PDDL_OBJECT_TYPE", message, declared.place)


def _refuse_foreign(name: str, at: TypedName | Atom, scope: Scope) -> None:
    message = f"{name!r} has the form of another component's unit or stream"
    fix = f"names of shared objects have no {OWNED_MARK!r}; own units go by their local names"
    scope.report.problem("PDDL_OWNED", message, at.place, fix)


def facts_of(fragments: Sequence[FragmentSyntax], scope: Scope) -> tuple[FactClaim, ...]:
    """The facts asserted (PDDL_UNKNOWN, PDDL_TYPE, PDDL_ARITY, PDDL_OWNED, PDDL_INIT).

    A fact may name objects that this component does not declare: it waits until they are there.
    """
    claims = []
    for fragment in fragments:
        for formula in fragment.init if isinstance(fragment, ProblemFragment) else ():
            atom = _asserted(formula, scope)
            if atom and _is_sound(atom, scope):
                text = bind(atom, _resolved(atom, scope))
                claims.append(FactClaim(text, scope.report.origin(atom.place)))
    return tuple(claims)


def _asserted(formula: Formula, scope: Scope) -> Atom | None:
    if isinstance(formula, Atom):
        return formula
    if not isinstance(formula, Numeric) or formula.operator != "=":
        scope.report.problem("PDDL_INIT", f"{formula} is not a fact", formula.place)
    return None


def values_of(fragments: Sequence[FragmentSyntax], scope: Scope) -> tuple[ValueClaim, ...]:
    """The values given to functions (PDDL_UNKNOWN, PDDL_TYPE, PDDL_ARITY, PDDL_INIT, PDDL_TWICE).

    `total-cost` is a plan's own, and begins with 0 whatever is said.
    """
    claims: dict[str, ValueClaim] = {}
    for fragment in fragments:
        for formula in fragment.init if isinstance(fragment, ProblemFragment) else ():
            match formula:
                case Numeric("=", Atom("total-cost")):
                    continue
                case Numeric("=", Atom() as function, float(value)):
                    if not is_exact(value):
                        message = f"{formula}: only whole numbers below 2^53 are handled"
                        scope.report.problem("PDDL_INIT", message, formula.place)
                    elif scope.check_function(function, {}):
                        text = bind(function, _resolved(function, scope))
                        claim = ValueClaim(text, int(value), scope.report.origin(formula.place))
                        _check_agrees(claim, claims.setdefault(text, claim), formula, scope)
                case Numeric(operator="="):
                    message = f"{formula} gives no function a number"
                    scope.report.problem("PDDL_INIT", message, formula.place)
    return tuple(claims.values())


def _check_agrees(claim: ValueClaim, known: ValueClaim, formula: Numeric, scope: Scope) -> None:
    if claim.value != known.value:
        message = f"({claim.function}) is {known.value} at {known.origin.place}"
        scope.report.problem("PDDL_TWICE", message, formula.place)


def _resolved(atom: Atom, scope: Scope) -> dict[str, str]:
    return {term.name: scope.resolve(term.name) for term in atom.terms}


def _is_sound(atom: Atom, scope: Scope) -> bool:
    problems_before = len(scope.report.problems)
    names = {term.name for term in atom.terms if not term.is_variable}
    strangers = {name for name in names if scope.resolve(name) not in scope.objects}
    for name in strangers:
        if OWNED_MARK in name:
            _refuse_foreign(name, atom, scope)
    scope.check_atom(atom, dict.fromkeys(strangers, (ROOT,)))
    scope.check_writable(atom)
    return len(scope.report.problems) == problems_before
