"""The phrases that plugins declare, read and tied to the condition that each asks for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import cast, get_args

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import Action, Merged
from nondum.planning.merge.goal import GoalKind, condition_problems, read_goal
from nondum.planning.merge.scope import SELF
from nondum.planning.pddl.normal import Condition
from nondum.planning.pddl.syntax import Term, TypedName
from nondum.planning.words.pattern import (
    Optional,
    Part,
    PatternInvalid,
    Slot,
    parse_pattern,
    slots_of,
)
from nondum.sdk.description import Phrase
from nondum.sdk.errors import GoalRefused, Problem
from nondum.sdk.frozen import frozen

MAX_SLOTS = 3
MAX_OPTIONAL_PARTS = 4
"""Both bound the ways to read a sentence."""


@frozen
class KnownPhrase:
    """A pattern and what it asks for."""

    pattern: str
    """As its author wrote it."""
    parts: tuple[Part, ...]
    condition: Condition
    """With a variable for each binding slot, and `self`."""
    kind: GoalKind
    plugin: str
    component: str
    """One that runs the plugin."""

    def binding_slots(self) -> Iterator[Slot]:
        """The slots whose words name an object."""
        return (slot for slot in slots_of(self.parts) if not slot.is_free)


def known_phrases(
    contributions: Iterable[Contribution], merged: Merged
) -> tuple[tuple[KnownPhrase, ...], tuple[Problem, ...]]:
    """All phrases that can be used, and a PHRASE_INVALID for each that cannot."""
    known: list[KnownPhrase] = []
    problems: list[Problem] = []
    for contribution in contributions:
        for pattern, source in _declared(contribution, merged):
            try:
                known.append(_known(pattern, source, contribution, merged))
            except PatternInvalid as wrong:
                where = f"{contribution.plugin} {contribution.version} phrase {pattern!r}"
                problems.append(Problem("PHRASE_INVALID", str(wrong), where=where))
    return tuple(known), tuple(problems)


def _declared(contribution: Contribution, merged: Merged) -> Iterator[tuple[str, Phrase | Action]]:
    for phrase in contribution.phrases:
        yield phrase.pattern, phrase
    actions = merged.domain.actions.values()
    by_behaviour = {a.behaviour: a for a in actions if a.plugin == contribution.plugin}
    for behaviour in contribution.behaviours or ():
        for pattern in behaviour.phrases:
            yield pattern, by_behaviour[behaviour.name]


def _known(pattern: str, source: Phrase | Action, by: Contribution, merged: Merged) -> KnownPhrase:
    parts = parse_pattern(pattern)
    if isinstance(source, Action):
        parts = _typed(parts, source)
        condition = _effect_asked_for(source, parts)
        kind: GoalKind = "maintain" if source.lasting else "achieve"
    else:
        condition = _condition(source, parts, merged)
        kind = cast(GoalKind, source.kind) if source.kind in get_args(GoalKind) else "achieve"
    known = KnownPhrase(pattern, parts, condition, kind, by.plugin, by.component)
    _check_slots(known, merged)
    return known


def _typed(parts: tuple[Part, ...], action: Action) -> tuple[Part, ...]:
    """The parts with each slot named after a parameter, and of its types."""
    typed: list[Part] = []
    for part in parts:
        if isinstance(part, Optional):
            typed.append(Optional(_typed(part.parts, action)))
        elif isinstance(part, Slot) and not part.is_free:
            parameter = _parameter(part, action)
            typed.append(Slot(parameter.name.removeprefix("?"), part.types or parameter.types))
        else:
            typed.append(part)
    return tuple(typed)


def _parameter(slot: Slot, action: Action) -> TypedName:
    """The parameter that a slot names, by its name or, if there is one such, by its type."""
    named = [p for p in action.parameters if p.name == f"?{slot.name}"]
    named = named or [p for p in action.parameters if p.types == (slot.name,)]
    if len(named) != 1:
        raise PatternInvalid(f"slot {{{slot.name}}} is no parameter of {action.local!r}")
    return named[0]


def _effect_asked_for(action: Action, parts: tuple[Part, ...]) -> Condition:
    """What the action makes true of the things named, and of this robot."""
    names = {p.name: SELF for p in action.parameters if p.types == ("host",)}
    names.update({f"?{slot.name}": f"?{slot.name}" for slot in slots_of(parts)})
    said = [a for a in action.effect.add if all(_is_said(term, names) for term in a.terms)]
    if not said:
        raise PatternInvalid(f"{action.local!r} makes nothing true of what is named in it")
    return Condition(positive=tuple(said)).bound(names)


def _is_said(term: Term, names: Mapping[str, str]) -> bool:
    return not term.is_variable or term.name in names


def _condition(phrase: Phrase, parts: tuple[Part, ...], merged: Merged) -> Condition:
    types = {f"?{slot.name}": slot.types for slot in slots_of(parts) if not slot.is_free}
    try:
        condition = read_goal(phrase.goal)
    except GoalRefused as refused:
        raise PatternInvalid(str(refused)) from refused
    problems = condition_problems(condition, phrase.goal, merged, types)
    if problems:
        raise PatternInvalid("; ".join(map(str, problems)))
    return condition


def _check_slots(phrase: KnownPhrase, merged: Merged) -> None:
    slots = tuple(slots_of(phrase.parts))
    if len(slots) > MAX_SLOTS:
        raise PatternInvalid(f"more than {MAX_SLOTS} slots")
    if _optional_parts(phrase.parts) > MAX_OPTIONAL_PARTS:
        raise PatternInvalid(f"more than {MAX_OPTIONAL_PARTS} parts in []")
    for part in phrase.parts:
        if isinstance(part, Optional) and not all(slot.is_free for slot in slots_of(part.parts)):
            raise PatternInvalid("what is in [] may be left out, so it cannot name anything")
    for slot in phrase.binding_slots():
        unknown = [name for name in slot.types if name not in merged.domain.types]
        if unknown or not slot.types:
            raise PatternInvalid(f"slot {{{slot.name}}} has no known type")


def _optional_parts(parts: tuple[Part, ...]) -> int:
    return sum(1 + _optional_parts(part.parts) for part in parts if isinstance(part, Optional))
