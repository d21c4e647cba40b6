"""Which schemas a goal can have to do with at all: asked before anything is bound."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TypeAlias

from nondum.planning.domain import Action, DerivedRule, Merged
from nondum.planning.goal import GoalExpr
from nondum.planning.normal import Condition, atoms_in
from nondum.planning.syntax import Atom

Wish: TypeAlias = tuple[str, bool]
"""A predicate, and whether facts of it are to be true."""


@dataclass(frozen=True, slots=True)
class Concern:
    """The part of a domain that a goal depends on."""

    merged: Merged
    """Only the schemas that give what the goal, or another of them, asks for."""
    read: frozenset[str]
    """The predicates that any of them reads: facts of others do not matter."""


def concern(merged: Merged, goal: GoalExpr) -> Concern:
    """Go back from the goal's predicates to everything that gives what is asked for."""
    givers: defaultdict[Wish, list[Action]] = defaultdict(list)
    for action in merged.domain.actions.values():
        for wish in set(_given(action)):
            givers[wish].append(action)
    rules: defaultdict[str, list[DerivedRule]] = defaultdict(list)
    for rule in merged.domain.derived:
        rules[rule.head.predicate].append(rule)
    waiting = set(_wishes(goal))
    asked: set[Wish] = set()
    actions: set[str] = set()
    while waiting:
        wish = waiting.pop()
        asked.add(wish)
        predicate, is_true = wish
        for rule in rules[predicate]:
            waiting.update((p, sign is is_true) for p, sign in _wishes(rule.condition))
        for action in givers[wish]:
            actions.add(action.name)
            waiting.update(_asked(action))
        waiting -= asked
    domain = replace(
        merged.domain,
        actions={name: a for name, a in merged.domain.actions.items() if name in actions},
    )
    return Concern(replace(merged, domain=domain), frozenset(predicate for predicate, _ in asked))


def _given(action: Action) -> Iterator[Wish]:
    yield from _signed(action.effect.added(), is_true=True)
    yield from _signed(action.effect.deleted(), is_true=False)


def _asked(action: Action) -> Iterator[Wish]:
    """What the action needs, and needs for or against each of its conditional changes."""
    yield from _wishes(action.precondition)
    for change in action.effect.conditional:
        for predicate, _ in _wishes(change.condition):
            yield predicate, True
            yield predicate, False


def _signed(atoms: Iterable[Atom], *, is_true: bool) -> Iterator[Wish]:
    return ((atom.predicate, is_true) for atom in atoms)


def _wishes(condition: Condition) -> Iterator[Wish]:
    for part in condition.parts():
        for atom, is_positive in atoms_in(part):
            yield atom.predicate, is_positive
