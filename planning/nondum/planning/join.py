"""Finding all bindings of an action's parameters for which its conditions can hold.

Facts come one at a time; each is matched with every condition that it fits, and the remaining
conditions are joined with the facts that came before, smallest choice first. So every binding is
found once its last fact is there, without walking through all combinations of objects.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

Tuple: TypeAlias = tuple[str, ...]
Binding: TypeAlias = dict[str, str]


@dataclass(slots=True)
class Relations:
    """Facts by predicate, and by predicate, position and object."""

    rows: defaultdict[str, list[Tuple]] = field(default_factory=lambda: defaultdict(list))
    index: defaultdict[tuple[str, int, str], list[Tuple]] = field(
        default_factory=lambda: defaultdict(list)
    )

    def add(self, predicate: str, arguments: Tuple) -> None:
        """Add a fact that is not there yet."""
        self.rows[predicate].append(arguments)
        for position, argument in enumerate(arguments):
            self.index[predicate, position, argument].append(arguments)

    def candidates(self, pattern: Pattern, binding: Mapping[str, str]) -> Sequence[Tuple]:
        """The smallest list of facts that contains all that fit the pattern."""
        found: Sequence[Tuple] = self.rows[pattern.predicate]
        for position, term in enumerate(pattern.terms):
            value = binding.get(term) if term[0] == "?" else term
            if value is not None:
                bucket = self.index.get((pattern.predicate, position, value), ())
                if len(bucket) < len(found):
                    found = bucket
        return found


@dataclass(frozen=True, slots=True)
class Pattern:
    """A condition `(predicate term …)`; terms with `?` are variables."""

    predicate: str
    terms: Tuple


@dataclass(frozen=True, slots=True)
class Rule:
    """What the join needs to know of an action."""

    variables: Tuple
    domains: Mapping[str, frozenset[str]]
    """Variable → the objects of its types."""
    patterns: tuple[Pattern, ...]
    equal: tuple[tuple[str, str], ...] = ()
    unequal: tuple[tuple[str, str], ...] = ()

    def allows(self, binding: Mapping[str, str]) -> bool:
        """Whether a complete binding keeps the equalities and inequalities."""
        return all(binding.get(a, a) == binding.get(b, b) for a, b in self.equal) and not any(
            binding.get(a, a) == binding.get(b, b) for a, b in self.unequal
        )


def matched(
    pattern: Pattern, arguments: Tuple, binding: Binding, domains: Mapping[str, frozenset[str]]
) -> Binding | None:
    """The binding extended so that the pattern becomes the fact; None if it cannot."""
    extended = binding
    for term, argument in zip(pattern.terms, arguments, strict=True):
        if term[0] != "?":
            if term != argument:
                return None
            continue
        value = extended.get(term)
        if value is None:
            if argument not in domains[term]:
                return None
            if extended is binding:
                extended = dict(binding)
            extended[term] = argument
        elif value != argument:
            return None
    return extended


def bindings(rule: Rule, relations: Relations, trigger: int, arguments: Tuple) -> Iterator[Binding]:
    """All bindings of a rule in which condition number `trigger` is the fact `arguments`."""
    start = matched(rule.patterns[trigger], arguments, {}, rule.domains)
    if start is not None:
        others = [p for i, p in enumerate(rule.patterns) if i != trigger]
        yield from _joined(rule, relations, others, start)


def unconditional(rule: Rule) -> Iterator[Binding]:
    """All bindings of a rule without patterns."""
    yield from _enumerated(rule, {})


def _joined(
    rule: Rule, relations: Relations, patterns: list[Pattern], binding: Binding
) -> Iterator[Binding]:
    if not patterns:
        yield from _enumerated(rule, binding)
        return
    sizes = [len(relations.candidates(pattern, binding)) for pattern in patterns]
    chosen = sizes.index(min(sizes))
    pattern, others = patterns[chosen], patterns[:chosen] + patterns[chosen + 1 :]
    for arguments in relations.candidates(pattern, binding):
        extended = matched(pattern, arguments, binding, rule.domains)
        if extended is not None:
            yield from _joined(rule, relations, others, extended)


def _enumerated(rule: Rule, binding: Binding) -> Iterator[Binding]:
    """Complete a binding with every object for the variables that no condition speaks of."""
    for variable in rule.variables:
        if variable not in binding:
            for value in sorted(rule.domains[variable]):
                yield from _enumerated(rule, {**binding, variable: value})
            return
    if rule.allows(binding):
        yield binding
