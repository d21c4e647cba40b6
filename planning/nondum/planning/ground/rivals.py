"""Functional predicates: at most one last argument for each of the others (rule M17 of merging)."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Mapping
from typing import TypeAlias

from nondum.sdk.errors import Problem

Weight: TypeAlias = tuple[int, float, int]
"""Sort key of rival facts: the heaviest is believed."""


def group_of(fact: str) -> str:
    """What the rival values of a functional predicate share: all of it but the last argument.

    >>> group_of("at rover kitchen")
    'at rover'
    """
    return fact.rpartition(" ")[0]


def outdone(
    facts: Iterable[str], functional: Container[str], weigh: Callable[[str], Weight]
) -> set[str]:
    """The facts that give way to a heavier one of their functional predicate."""
    groups: dict[str, list[str]] = {}
    for fact in facts:
        if fact.partition(" ")[0] in functional:
            groups.setdefault(group_of(fact), []).append(fact)
    found: set[str] = set()
    for rivals in groups.values():
        if len(rivals) > 1:
            best = max(rivals, key=lambda fact: (weigh(fact), fact))
            found.update(fact for fact in rivals if fact != best)
    return found


def conflict(says: Mapping[str, str], believed: str) -> Problem:
    """Components observe rival facts: component → what it says; `believed` is the newest."""
    told = ", ".join(f"{who} says ({fact})" for who, fact in sorted(says.items()))
    newest = f"; the newest is believed: ({believed})" if believed else ""
    return Problem(
        "PDDL_FACT_CONFLICT",
        f"only one of them can hold, but {told}{newest}",
        where=f"({group_of(min(says.values()))} …)",
        fix="see `nondum facts --why`, and unplug or mend the one that is wrong",
    )
