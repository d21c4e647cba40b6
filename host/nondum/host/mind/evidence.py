"""What is believed and why, as plain data for people's tools."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeAlias

from nondum.host.mind.beliefs import Beliefs
from nondum.host.mind.composition import Composition
from nondum.planning.execute.provenance import Source, SourceKind
from nondum.planning.ground.conclusions import conclusions
from nondum.planning.merge.core import HOST_PREDICATES, TAKEN_PREDICATES
from nondum.planning.merge.domain import Action, DerivedRule, Merged
from nondum.planning.merge.scope import SELF
from nondum.planning.pddl.caret import nearest, refusal
from nondum.planning.pddl.facts import fact, parts
from nondum.planning.pddl.parse import parse_formula
from nondum.planning.pddl.syntax import Atom, Not
from nondum.sdk.errors import FragmentRefused

Row: TypeAlias = dict[str, Any]


def believed(
    beliefs: Beliefs, composition: Composition | None, users: Mapping[str, str]
) -> list[Row]:
    """All that is believed: `fact`, `age_s` (since somebody has said so; nothing for what follows
    by rules), `source`, `value`. `users` are units and streams that a running behaviour uses and
    which; those that serve several are `idle` and `free` all the same."""
    follows = _conclusions(beliefs, composition)
    rows = [_with_user(_row(text, beliefs), users) for text in beliefs.world.facts]
    rows += [
        {"fact": text, "age_s": None, "source": _by_rules(rules), "value": None}
        for text, rules in follows.items()
    ]
    return sorted(rows, key=lambda row: str(row["fact"]))


def _with_user(row: Row, users: Mapping[str, str]) -> Row:
    predicate, arguments = parts(row["fact"])
    user = users.get(arguments[0]) if predicate in TAKEN_PREDICATES and arguments else None
    return row if user is None else {**row, "source": f"{user} uses it, and others may, too"}


def _conclusions(
    beliefs: Beliefs, composition: Composition | None
) -> Mapping[str, tuple[DerivedRule, ...]]:
    return conclusions(composition.merged, beliefs.world.facts) if composition else {}


def _by_rules(rules: Iterable[DerivedRule]) -> str:
    return f"it follows by {' or '.join(str(rule.origins[0]) for rule in rules)}"


def parked(beliefs: Beliefs) -> list[Row]:
    """What waits for objects: as `believed`, and `absent`, the objects that are not there."""
    return [
        {**_row(text, beliefs), "absent": list(beliefs.world.evidence(text).absent)}
        for text in beliefs.world.parked()
    ]


def explained(asked: str, beliefs: Beliefs, composition: Composition | None) -> Row:
    """One fact, true or not, with everything that bears on it.

    `fact`, `holds`, `value`; `for` and `against`: rows of `component`, `kind`, `said`, `behaviour`,
    `age_s`; `instead`: the other value of a functional predicate; `absent`: objects that it waits
    for; `assumed_by`, `denied_by`: actions whose effects would make it true or false;
    `observed_by`: conditions that keep it; `hint`: what is wrong with the words of it. Raises
    `FragmentRefused` (PDDL_SYNTAX) for what is not one fact.
    """
    text = _named(asked, beliefs.snapshot.host)
    found = beliefs.world.evidence(text)
    follows = _conclusions(beliefs, composition).get(text, ())
    merged = composition.merged if composition else None
    actions = merged.domain.actions if merged else {}
    return {
        "fact": text,
        "holds": found.holds or bool(follows),
        "value": beliefs.world.value(text),
        "for": [
            *(_word(source, actions, beliefs) for source in found.pros),
            *(_rule_word(rule) for rule in follows),
        ],
        "against": [_word(source, actions, beliefs) for source in found.cons],
        "instead": found.rival or None,
        "absent": list(found.absent),
        "assumed_by": sorted(_writers(text, merged, are_adding=True)) if merged else [],
        "denied_by": sorted(_writers(text, merged, are_adding=False)) if merged else [],
        "observed_by": list(_observers(text, beliefs)),
        "hint": _hint(text, merged, composition) if merged and composition else "",
    }


def _row(text: str, beliefs: Beliefs) -> Row:
    found = beliefs.world.evidence(text)
    return {
        "fact": text,
        "age_s": _age_s(found.since_s, beliefs),
        "source": "; ".join(source.said for source in found.pros),
        "value": beliefs.world.value(text),
    }


def _rule_word(rule: DerivedRule) -> Row:
    return {
        "component": rule.origins[0].component,
        "kind": "rule",
        "said": _by_rules([rule]),
        "behaviour": "",
        "age_s": None,
    }


def _word(source: Source, actions: Mapping[str, Action], beliefs: Beliefs) -> Row:
    action = actions.get(source.action.partition(" ")[0])
    return {
        "component": "" if source.kind is SourceKind.HOST else source.who,
        "kind": source.kind.value,
        "said": source.said,
        "behaviour": action.behaviour if action else "",
        "age_s": _age_s(source.at_s, beliefs),
    }


def _age_s(at_s: float | None, beliefs: Beliefs) -> float | None:
    return None if at_s is None else round(max(0.0, beliefs.now_s() - at_s), 3)


def _named(asked: str, host: str) -> str:
    """A fact as a person writes it, with or without parentheses, as the world model does.

    Of one that is said not to hold, the fact. Raises `FragmentRefused` (PDDL_SYNTAX).
    """
    words = asked.lower().split()
    if words and words[0].startswith("("):
        match parse_formula(asked, "fact"):
            case (Atom() as atom) | Not(part=Atom() as atom):
                words = [atom.predicate, *(term.name for term in atom.terms)]
            case other:
                message = "expected one fact, such as (ready panther__eye__camera)"
                raise FragmentRefused(refusal("PDDL_SYNTAX", message, other.place, asked))
    return fact(*(host if word == SELF and i else word for i, word in enumerate(words)))


def _writers(text: str, merged: Merged, *, are_adding: bool) -> Iterator[str]:
    """The actions with an effect that may be this fact, made true or made false."""
    for action in merged.domain.actions.values():
        atoms = action.effect.added() if are_adding else action.effect.deleted()
        if any(_may_be(atom, text, action, merged) for atom in atoms):
            yield action.name


def _may_be(atom: Atom, text: str, action: Action, merged: Merged) -> bool:
    predicate, arguments = parts(text)
    if atom.predicate != predicate or len(atom.terms) != len(arguments):
        return False
    types = {parameter.name: parameter.types for parameter in action.parameters}
    return all(
        _fits(name, types.get(term.name), merged) if term.is_variable else term.name == name
        for term, name in zip(atom.terms, arguments, strict=True)
    )


def _fits(name: str, types: tuple[str, ...] | None, merged: Merged) -> bool:
    found = merged.objects.get(name)
    return not types or not found or merged.domain.types.is_one_of(found.types, types)


def _observers(text: str, beliefs: Beliefs) -> Iterator[str]:
    predicate, _ = parts(text)
    for _, component in beliefs.snapshot.everyone():
        for condition in component.description.conditions:
            if predicate in condition.predicates:
                yield f"{condition.name} of {component.id}"


def _hint(text: str, merged: Merged, composition: Composition) -> str:
    """What is wrong with a fact's words, and what was probably meant."""
    predicate, arguments = parts(text)
    known = merged.domain.predicates.get(predicate)
    if known is None:
        near = nearest(predicate, merged.domain.predicates)
        return _joined(f"the predicate {predicate!r} is not declared", near)
    if known.arity != len(arguments):
        return f"{predicate!r} takes {known.arity} arguments, not {len(arguments)}"
    unknown = [name for name in arguments if name not in merged.objects]
    if not unknown:
        return "the host itself says so, or not" if predicate in HOST_PREDICATES else ""
    near = nearest(unknown[0], _known_names(merged, composition))
    return _joined(f"there is no object {unknown[0]!r} now", near)


def _known_names(merged: Merged, composition: Composition) -> Iterable[str]:
    return {*merged.objects, *composition.book.labels}


def _joined(*said: str) -> str:
    return ": ".join(filter(None, said))
