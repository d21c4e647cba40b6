"""What follows from the facts that hold, by the rules of derived predicates."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from nondum.planning.ground.bounds import TooManyBindings
from nondum.planning.ground.exploration import explore
from nondum.planning.ground.literal_task import expanded
from nondum.planning.ground.negation import positive_task
from nondum.planning.ground.progression import start
from nondum.planning.merge.derivation import asked_by
from nondum.planning.merge.domain import DerivedRule, Merged
from nondum.planning.pddl.facts import predicate_of
from nondum.planning.pddl.normal import Condition

LIMIT = 5_000
"""Bindings of rules, at most: people who ask what is believed do not wait for more."""


def conclusions(merged: Merged, facts: Iterable[str]) -> Mapping[str, tuple[DerivedRule, ...]]:
    """Derived facts that hold where exactly `facts` do, each with the rules that can give it.

    Nothing is said of what follows by the rules of a component that has too many ways to bind
    them, or by other rules that ask for it.
    """
    rules, believed = merged.domain.derived, frozenset(facts)
    while rules:
        try:
            return _drawn(merged, rules, believed)
        except TooManyBindings as refused:
            rules = _without(rules, refused.components)
    return {}


def _without(rules: tuple[DerivedRule, ...], components: frozenset[str]) -> tuple[DerivedRule, ...]:
    """The rules that need nothing which one of these components says."""
    gone = {r.head.predicate for r in rules if r.origins[0].component in components}
    while True:
        kept = tuple(r for r in rules if gone.isdisjoint((r.head.predicate, *asked_by(r))))
        if len(kept) == len(rules):
            return kept
        gone |= {r.head.predicate for r in rules} - {r.head.predicate for r in kept}
        rules = kept


def _drawn(
    merged: Merged, derived: tuple[DerivedRule, ...], facts: frozenset[str]
) -> Mapping[str, tuple[DerivedRule, ...]]:
    only_rules = replace(merged, domain=replace(merged.domain, actions={}, derived=derived))
    found = explore(only_rules, facts, limit=LIMIT)
    task = positive_task(expanded(only_rules, found, Condition(), limit=LIMIT), found.table)
    rules: dict[str, tuple[DerivedRule, ...]] = {}
    for rule in derived:
        name = rule.head.predicate
        rules[name] = (*rules.get(name, ()), rule)
    names = (task.facts[number] for number in start(task))
    return {
        name: rules[predicate_of(name)] for name in sorted(names) if predicate_of(name) in rules
    }
