"""What follows from the facts that hold, by the rules of derived predicates."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from nondum.planning.domain import DerivedRule, Merged
from nondum.planning.draft import drafted
from nondum.planning.exploration import explore
from nondum.planning.facts import predicate_of
from nondum.planning.normal import Condition
from nondum.planning.polarity import positive_task
from nondum.planning.progression import start


def conclusions(merged: Merged, facts: Iterable[str]) -> Mapping[str, tuple[DerivedRule, ...]]:
    """Derived facts that hold where exactly `facts` do, each with the rules that can give it."""
    if not merged.domain.derived:
        return {}
    without_actions = replace(merged, domain=replace(merged.domain, actions={}))
    found = explore(without_actions, facts)
    task = positive_task(drafted(without_actions, found, Condition()), found.table)
    rules: dict[str, tuple[DerivedRule, ...]] = {}
    for rule in merged.domain.derived:
        name = rule.head.predicate
        rules[name] = (*rules.get(name, ()), rule)
    names = (task.facts[number] for number in start(task))
    return {
        name: rules[predicate_of(name)] for name in sorted(names) if predicate_of(name) in rules
    }
