"""One action as its fragment declares it: checked, and named after its plugin."""

from __future__ import annotations

from itertools import chain

from nondum.planning.merge.derivation import typed
from nondum.planning.merge.domain import Action
from nondum.planning.merge.effect import Effect, effect_of
from nondum.planning.merge.scope import SELF, Scope
from nondum.planning.pddl.caret import Misplaced
from nondum.planning.pddl.normal import Condition, condition_of
from nondum.planning.pddl.syntax import ActionDeclaration, TypedName, terms_of
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
    _check_actor(declared, scope)
    _check_instances(declared, scope)
    read = read_action(declared, scope)
    if read is None:
        return None
    parameters, precondition, effect = read
    lasting = behaviour.lasting if behaviour else True
    _check_lasting(declared, effect, scope, lasting=lasting and behaviour is not None)
    scope.check_ownership(effect, lasting=lasting)
    if len(scope.report.problems) > problems_before:
        return None
    return Action(
        name=f"{plugin}.{declared.name}",
        plugin=plugin,
        parameters=parameters,
        precondition=precondition,
        effect=effect,
        lasting=behaviour.lasting if behaviour else _takes_something(effect),
        behaviour=behaviour.name if behaviour else "",
        origins=(scope.report.origin(declared.place),),
    )


def read_action(
    declared: ActionDeclaration, scope: Scope, *, unnamed_cost: int = 1
) -> tuple[tuple[TypedName, ...], Condition, Effect] | None:
    """Parameters, precondition and effect, all names checked; None if something is wrong.

    An action that names no cost has `unnamed_cost`.
    """
    problems_before = len(scope.report.problems)
    if len(declared.parameters) > PARAMETERS_LIMIT:
        message = f"action {declared.name!r} has more than {PARAMETERS_LIMIT} parameters"
        scope.report.problem("PDDL_TOO_MANY", message, declared.place)
        return None
    parameters = typed(declared.parameters)
    variables = {p.name: p.types for p in scope.checked_types(parameters)}
    try:
        precondition = condition_of(declared.precondition)
        effect = effect_of(declared.effect, variables, unnamed_cost=unnamed_cost)
    except Misplaced as wrong:
        scope.report.problem(wrong.code, wrong.message, wrong.place, wrong.fix)
        return None
    scope.check_formula(declared.precondition, variables)
    scope.check_formula(declared.effect, variables)
    if len(scope.report.problems) > problems_before:
        return None
    return parameters, precondition, effect


def _check_actor(declared: ActionDeclaration, scope: Scope) -> None:
    actor = typed(declared.parameters[:1])
    is_known = all(type_ in scope.graph for p in actor for type_ in p.types)
    if actor and (not is_known or scope.graph.all_kind_of(actor[0].types, (ACTOR_TYPE,))):
        return
    message = f"the first parameter of {declared.name!r} is not a unit"
    fix = "the first parameter is the actor: add one, such as ?u - camera"
    place = actor[0].place if actor else declared.place
    scope.report.problem("PDDL_ACTOR", message, place, fix)


def _check_instances(declared: ActionDeclaration, scope: Scope) -> None:
    for term in chain(terms_of(declared.precondition), terms_of(declared.effect)):
        if term.name == SELF or term.name in scope.locals:
            message = f"{term.name!r} names one instance, and an action serves all of them"
            fix = "use a parameter, such as ?h - host with (on ?u ?h)"
            scope.report.problem("PDDL_INSTANCE", message, term.place, fix)


def _check_lasting(
    declared: ActionDeclaration, effect: Effect, scope: Scope, *, lasting: bool
) -> None:
    """What holds only while a behaviour runs cannot depend on how things were when it began."""
    if lasting and effect.conditional:
        message = f"{declared.name!r} is lasting, and has effects under conditions"
        fix = "make a separate action for each case"
        scope.report.problem("PDDL_UNSUPPORTED", message, declared.place, fix)


def _takes_something(effect: Effect) -> bool:
    return any(atom.predicate in ("idle", "free") for atom in effect.delete)
