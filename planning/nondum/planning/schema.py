"""One action as its fragment declares it: checked, and named after its plugin."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain

from nondum.planning.caret import Misplaced
from nondum.planning.domain import Action
from nondum.planning.normal import Condition, Effect, condition_of, effect_of
from nondum.planning.scope import SELF, Scope
from nondum.planning.syntax import ActionDeclaration, TypedName
from nondum.planning.typegraph import types_or_root
from nondum.sdk.description import Behaviour

ACTOR_TYPE = "unit"

PARAMETERS_LIMIT = 16


def schema_of(
    declared: ActionDeclaration, plugin: str, behaviour: Behaviour | None, scope: Scope
) -> Action | None:
    """Check an action and give its schema, the actor not yet narrowed; None if it is wrong.

    Without a behaviour it counts as lasting when it takes something (deletes `idle` or `free`).
    """
    problems_before = len(scope.report.problems)
    if len(declared.parameters) > PARAMETERS_LIMIT:
        message = f"action {declared.name!r} has more than {PARAMETERS_LIMIT} parameters"
        scope.report.problem("PDDL_TOO_MANY", message, declared.place)
        return None
    variables = _variables(declared, scope)
    try:
        precondition, effect = condition_of(declared.precondition), effect_of(declared.effect)
    except Misplaced as wrong:
        scope.report.problem(wrong.code, wrong.message, wrong.place, wrong.fix)
        return None
    lasting = behaviour.lasting if behaviour else True
    _check_names(precondition, effect, variables, scope)
    scope.check_ownership(effect, lasting=lasting)
    if len(scope.report.problems) > problems_before:
        return None
    return Action(
        name=f"{plugin}.{declared.name}",
        plugin=plugin,
        parameters=_typed(declared),
        precondition=precondition,
        effect=effect,
        lasting=behaviour.lasting if behaviour else _takes_something(effect),
        behaviour=behaviour.name if behaviour else "",
        origins=(scope.report.origin(declared.place),),
    )


def _typed(declared: ActionDeclaration) -> tuple[TypedName, ...]:
    return tuple(
        TypedName(parameter.name, types_or_root(parameter.types), parameter.place)
        for parameter in declared.parameters
    )


def _variables(declared: ActionDeclaration, scope: Scope) -> dict[str, tuple[str, ...]]:
    parameters = _typed(declared)
    known = [scope.known_types(p.types, p.place) for p in parameters]
    if not parameters or (
        known[0] and not scope.graph.all_kind_of(parameters[0].types, (ACTOR_TYPE,))
    ):
        message = f"the first parameter of {declared.name!r} is not a unit"
        fix = "the first parameter is the actor: add one, such as ?u - camera"
        place = parameters[0].place if parameters else declared.place
        scope.report.problem("E-ACTOR", message, place, fix)
    return {p.name: p.types for p, ok in zip(parameters, known, strict=True) if ok}


def _check_names(
    condition: Condition, effect: Effect, variables: Mapping[str, tuple[str, ...]], scope: Scope
) -> None:
    for term in chain(condition.terms(), (t for atom in effect.atoms() for t in atom.terms)):
        if term.name == SELF or term.name in scope.locals:
            message = f"{term.name!r} names one instance, and an action serves all of them"
            fix = "use a parameter, such as ?h - host with (on ?u ?h)"
            scope.report.problem("E-INSTANCE", message, term.place, fix)
    for atom in condition.atoms() + effect.atoms():
        scope.check_atom(atom, variables)
    for pair in condition.pairs():
        for term in (pair.left, pair.right):
            scope.check_term(term, ("object",), variables)


def _takes_something(effect: Effect) -> bool:
    return any(atom.predicate in ("idle", "free") for atom in effect.delete)
