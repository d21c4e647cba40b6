"""Which schemas a goal can depend on, before anything is bound."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TypeAlias

from nondum.planning.ground.instances import Row
from nondum.planning.merge.domain import Action, DerivedRule, Merged, functional_predicates
from nondum.planning.merge.goal import GoalExpr
from nondum.planning.pddl.facts import predicate_of
from nondum.planning.pddl.normal import Condition, atoms_in, quantified_in
from nondum.planning.pddl.syntax import Atom, Term
from nondum.sdk.frozen import frozen

Wish: TypeAlias = tuple[str, bool, tuple[str, ...]]
"""A predicate, whether the fact is to be true, and its arguments; empty: whatever it is."""


_MOST = 16
"""Patterns of one predicate, at most; beyond them all its facts are asked for."""


@frozen
class RelevantPart:
    """The part of a domain that a goal depends on."""

    merged: Merged
    """Only the schemas that give what the goal, or another of them, asks for."""
    wishes: Wishes

    def known(self, facts: Iterable[str]) -> tuple[str, ...]:
        """Those of the facts that are asked about: others do not matter."""
        read = self.wishes.read
        return tuple(text for text in facts if predicate_of(text) in read)


class Wishes:
    """What is asked for: facts with some arguments known."""

    def __init__(self) -> None:
        self._patterns: defaultdict[tuple[str, bool], list[Row]] = defaultdict(list)

    @property
    def read(self) -> frozenset[str]:
        """The predicates that are asked for."""
        return frozenset(predicate for predicate, _ in self._patterns)

    def new(self, wishes: Iterable[Wish]) -> Iterator[Wish]:
        """Ask for something; gives what was not asked for before, or something wider."""
        for predicate, is_true, row in wishes:
            if self.include(predicate, row, is_true=is_true):
                continue
            patterns = self._patterns[predicate, is_true]
            if len(patterns) == _MOST:
                patterns.clear()
                row = ("",) * len(row)
            patterns.append(row)
            yield predicate, is_true, row

    def include(self, predicate: str, row: Row, *, is_true: bool) -> bool:
        """Whether a fact is among what is asked for."""
        for pattern in self._patterns.get((predicate, is_true), ()):
            for asked, argument in zip(pattern, row, strict=True):
                if asked and asked != argument:
                    break
            else:
                return True
        return False


def relevant_part(merged: Merged, goal: GoalExpr) -> RelevantPart:
    """Go back from the goal to everything that gives what is asked for.

    Objects that the goal names are passed on to the schemas that it asks, and on by them: a goal
    about persons asks no detector for geese. Source: magic sets (Bancilhon et al. 1986).
    """
    givers: defaultdict[tuple[str, bool], list[tuple[Action, Atom]]] = defaultdict(list)
    for action in merged.domain.actions.values():
        for atom in action.effect.added():
            givers[atom.predicate, True].append((action, atom))
        for atom in action.effect.deleted():
            givers[atom.predicate, False].append((action, atom))
    rules: defaultdict[str, list[DerivedRule]] = defaultdict(list)
    for rule in merged.domain.derived:
        rules[rule.head.predicate].append(rule)
    functional = functional_predicates(merged.domain)
    wishes = Wishes()
    waiting = list(wishes.new(_wishes(goal, {})))
    actions: set[str] = set()
    while waiting:
        predicate, is_true, row = waiting.pop()
        new: list[Wish] = []
        for rule in rules[predicate]:
            if (known := _matched(rule.head, row)) is not None:
                asked = _wishes(rule.condition, known)
                new += ((p, sign is is_true, asked_row) for p, sign, asked_row in asked)
        for action, atom in givers[predicate, is_true]:
            if (known := _matched(atom, row)) is not None:
                actions.add(action.name)
                new += _asked(action, known)
        if predicate in functional and row and not is_true:
            for action, atom in givers[predicate, True]:  # another value takes this one away
                if (known := _matched(atom, (*row[:-1], ""))) is not None:
                    actions.add(action.name)
                    new += _asked(action, known)
        waiting += wishes.new(new)
    kept = {name: a for name, a in merged.domain.actions.items() if name in actions}
    domain = replace(merged.domain, actions=kept)
    return RelevantPart(replace(merged, domain=domain), wishes)


def _matched(atom: Atom, row: Row) -> dict[str, str] | None:
    """What a wish says of the variables in an atom; None if the atom never fits it."""
    known: dict[str, str] = {}
    for term, argument in zip(atom.terms, row, strict=True):
        if not argument:
            continue
        if not term.is_variable:
            if term.name != argument:
                return None
        elif known.setdefault(term.name, argument) != argument:
            return None
    return known


def _asked(action: Action, known: Mapping[str, str]) -> Iterator[Wish]:
    """What the action needs, and needs for or against each of its conditional changes."""
    yield from _wishes(action.precondition, known)
    for change in action.effect.conditional:
        for predicate, _, row in _wishes(change.condition, known):
            yield predicate, True, row
            yield predicate, False, row


def _wishes(condition: Condition, known: Mapping[str, str]) -> Iterator[Wish]:
    """What a condition asks for; variables that are not known stand for anything."""
    for part in condition.parts():
        hidden = set(quantified_in(part))
        for atom, is_positive in atoms_in(part):
            yield (
                atom.predicate,
                is_positive,
                tuple(_known(term, known, hidden) for term in atom.terms),
            )


def _known(term: Term, known: Mapping[str, str], hidden: Collection[str]) -> str:
    if not term.is_variable:
        return term.name
    return "" if term.name in hidden else known.get(term.name, "")
