"""A step that no plan asked for: one behaviour of one component, on what fits it now. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from nondum.host.mind.composition import Composition
from nondum.planning.execute.step import Step
from nondum.planning.ground.lifted import Meaning
from nondum.planning.merge.domain import Action, Merged, bind
from nondum.sdk.errors import GoalRefused, Problem
from nondum.sdk.planner import GroundAction


def component_step(
    composition: Composition,
    facts: Iterable[str],
    behaviour: str,
    of: str,
    arguments: Mapping[str, str] | None = None,
) -> Step:
    """The step in which component `of` carries out a behaviour, its preconditions being true of
    `facts`.

    `arguments` binds some parameters, named without `?`; of several bindings that fit, the first
    in the order of names is taken. Raises `GoalRefused` (BEHAVIOUR_UNKNOWN, BEHAVIOUR_BLOCKED).
    """
    merged = composition.merged
    units = {name for name, found in merged.objects.items() if found.component == of}
    actions = [a for a in merged.domain.actions.values() if a.behaviour == behaviour]
    actors = {action.name: sorted(units & set(_actors(merged, action))) for action in actions}
    if not any(actors.values()):
        known = ", ".join(_behaviours(merged, units)) or "none"
        text = f"{of} has no behaviour {behaviour!r} now"
        raise GoalRefused(Problem("BEHAVIOUR_UNKNOWN", text, where=of, have=known))
    meaning = Meaning(merged, {name: found.types for name, found in merged.objects.items()})
    situation = meaning.situation(meaning.start(facts))
    given = {f"?{name}": value for name, value in (arguments or {}).items()}
    for action in actions:
        actor = action.parameters[0].name
        for unit in actors[action.name]:
            names = {actor: unit, **given}
            free = tuple(p for p in action.parameters if p.name not in names)
            found = situation.bindings(free, action.precondition, names)
            if (bound := next(iter(found), None)) is not None:
                return _step(action, bound)
    needed = ", ".join(f"({atom.predicate} …)" for atom in actions[0].precondition.positive)
    text = f"{of} cannot {behaviour} now: its preconditions do not hold"
    raise GoalRefused(Problem("BEHAVIOUR_BLOCKED", text, where=of, need=needed))


def _actors(merged: Merged, action: Action) -> Iterator[str]:
    if action.parameters:
        yield from merged.objects_of(*action.parameters[0].types)


def _behaviours(merged: Merged, units: set[str]) -> list[str]:
    actions = merged.domain.actions.values()
    own = {a.behaviour for a in actions if a.behaviour and units & set(_actors(merged, a))}
    return sorted(own)


def _step(action: Action, bound: Mapping[str, str]) -> Step:
    name = " ".join((action.name, *(bound[p.name] for p in action.parameters)))
    precondition = frozenset(bind(atom, bound) for atom in action.precondition.positive)
    add = frozenset(bind(atom, bound) for atom in action.effect.add)
    delete = frozenset(bind(atom, bound) for atom in action.effect.delete) - add
    ground = GroundAction(name, frozenset(), frozenset(), frozenset(), cost=action.effect.cost)
    return Step(ground, precondition, add, delete, action.lasting, precondition - delete)
