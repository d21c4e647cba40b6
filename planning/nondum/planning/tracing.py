"""Tracing a fact that cannot be reached back to what is missing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import Enum

from nondum.planning.core import HOST_PREDICATES
from nondum.planning.domain import Action, Merged
from nondum.planning.exploration import domains_of, members_of, patterns_of
from nondum.planning.facts import parts
from nondum.planning.matching import Binding, Pattern, Relations, matched
from nondum.planning.syntax import Atom, type_text
from nondum.sdk.errors import Problem

_PARTIAL_BINDINGS_LIMIT = 2000
"""How many are tried for one action; beyond it the best one so far is told."""


class Lack(Enum):
    """What kind of thing is missing."""

    ACTION = "WHY_NO_ACTION"
    """Nothing installed makes such a fact true."""
    OBJECT = "WHY_NO_OBJECT"
    """There is nothing of a type."""
    HOST = "WHY_NOT_SO"
    """The host does not say so: not ready, not on this body, in use."""
    EXCLUDED = "WHY_EXCLUDED"
    """All is there, but a negated or equality condition cannot be met."""


@dataclass(frozen=True, slots=True)
class Cause:
    """One root of a fact that cannot be reached."""

    lack: Lack
    fact: str
    """The condition that cannot be met; variables stand for what is not determined."""
    types: tuple[str, ...] = ()
    """For `Lack.OBJECT`: what there is none of."""
    path: tuple[str, ...] = ()
    """The actions that lead from here to the goal, the one that reaches the goal first."""

    def problem(self) -> Problem:
        """The cause in words."""
        through = f", for {' ← '.join(self.path)}" if self.path else ""
        return Problem(self.lack.value, f"{self._said()}{through}")

    def _said(self) -> str:
        match self.lack:
            case Lack.ACTION:
                return f"nothing here makes ({self.fact}) true"
            case Lack.OBJECT:
                return f"there is no {type_text(self.types)}"
            case Lack.HOST:
                return f"({self.fact}) does not hold"
            case Lack.EXCLUDED:
                return f"a condition excludes ({self.fact})"


def distinct(causes: Iterable[Cause]) -> tuple[Cause, ...]:
    """Each thing that is missing once, told along its shortest path."""
    found: dict[tuple[object, ...], Cause] = {}
    for cause in sorted(causes, key=lambda cause: len(cause.path)):
        found.setdefault((cause.lack, cause.types or cause.fact), cause)
    return tuple(found.values())


class Tracer:
    """Traces facts of one domain; `reachable` are those that can be reached."""

    def __init__(
        self, merged: Merged, types: Mapping[str, tuple[str, ...]], reachable: Iterable[str]
    ) -> None:
        members = members_of(merged, types)
        self._actions = tuple(merged.domain.actions.values())
        self._domains = {
            action.name: domains_of(action.parameters, members) for action in self._actions
        }
        self._relations = Relations()
        for text in sorted(reachable):
            self._relations.add(*parts(text))
        self._known: dict[Pattern, tuple[Cause, ...]] = {}
        self._open: set[Pattern] = set()

    def roots(self, wanted: Pattern) -> tuple[Cause, ...]:
        """The fewest causes that keep every fact of a pattern from being reached.

        Empty where tracing went in a circle.
        """
        key = Pattern(wanted.predicate, tuple("?" if t[0] == "?" else t for t in wanted.terms))
        if key in self._open:
            return ()
        if key not in self._known:
            self._open.add(key)
            self._known[key] = self._roots(wanted)
            self._open.remove(key)
        return self._known[key]

    def _roots(self, wanted: Pattern) -> tuple[Cause, ...]:
        text = " ".join((wanted.predicate, *wanted.terms))
        if wanted.predicate in HOST_PREDICATES:
            return (Cause(Lack.HOST, text),)
        chains = [
            chain
            for action in self._actions
            for atom in action.effect.added()
            if (binding := self._bound_by(action, atom, wanted)) is not None
            if (chain := self._through(action, binding, text))
        ]
        if not chains:
            return (Cause(Lack.ACTION, text),)
        return min(chains, key=lambda chain: (len(chain), chain[0].path))

    def _bound_by(self, action: Action, atom: Atom, wanted: Pattern) -> Binding | None:
        """How an action's effect becomes the fact wanted; what is open there stays open."""
        if atom.predicate != wanted.predicate:
            return None
        pairs = [
            (term.name, value)
            for term, value in zip(atom.terms, wanted.terms, strict=True)
            if value[0] != "?"
        ]
        pattern = Pattern(atom.predicate, tuple(name for name, _ in pairs))
        values = tuple(value for _, value in pairs)
        domains = self._domains[action.name]
        # A type that nothing has is a cause to be told, so it cannot rule the action out.
        open_domains = {name: objects or frozenset(values) for name, objects in domains.items()}
        return matched(pattern, values, {}, open_domains)

    def _through(self, action: Action, binding: Binding, text: str) -> tuple[Cause, ...]:
        """The causes that keep this action from giving the fact."""
        domains = self._domains[action.name]
        causes = [
            Cause(Lack.OBJECT, text, parameter.types)
            for parameter in action.parameters
            if not domains[parameter.name]
        ]
        if not causes:
            missing = _Search(action, domains, self._relations).least_missing(binding)
            causes = [cause for pattern in missing for cause in self.roots(pattern)]
            if not missing:
                causes = [Cause(Lack.EXCLUDED, text)]
        return distinct(replace(cause, path=(action.name, *cause.path)) for cause in causes)


class _Search:
    """Branch and bound over the bindings of one action, for the fewest conditions missing."""

    def __init__(
        self, action: Action, domains: Mapping[str, frozenset[str]], relations: Relations
    ) -> None:
        self._patterns = patterns_of(action.precondition)
        self._domains = domains
        self._relations = relations
        self._best: tuple[Pattern, ...] = self._patterns
        self._left = _PARTIAL_BINDINGS_LIMIT

    def least_missing(self, binding: Binding) -> tuple[Pattern, ...]:
        """The conditions that no reachable fact meets, under the best binding found."""
        self._best = tuple(_filled(pattern, binding) for pattern in self._patterns)
        for missing in self._walk(self._patterns, binding, ()):
            self._best = missing
        return self._best

    def _walk(
        self, patterns: tuple[Pattern, ...], binding: Binding, missing: tuple[Pattern, ...]
    ) -> Iterator[tuple[Pattern, ...]]:
        self._left -= 1
        if self._left < 0 or len(missing) >= max(len(self._best), 1):
            return
        if not patterns:
            yield tuple(_filled(pattern, binding) for pattern in missing)
            return
        pattern, others = patterns[0], patterns[1:]
        for arguments in self._relations.candidates(pattern, binding):
            extended = matched(pattern, arguments, binding, self._domains)
            if extended is not None:
                yield from self._walk(others, extended, missing)
        yield from self._walk(others, binding, (*missing, pattern))


def _filled(pattern: Pattern, binding: Binding) -> Pattern:
    return Pattern(pattern.predicate, tuple(binding.get(term, term) for term in pattern.terms))
