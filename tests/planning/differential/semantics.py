"""What PDDL means, in so few lines that they can be seen to be right.

Formulas are read as they were written, every quantifier walks through all objects, and every state
is a set of atoms. Nothing of the grounder is used: only the parser, and the types.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TypeAlias

from tests.planning.differential.texts import Text

from nondum.planning.pddl.parse import parse_fragment
from nondum.planning.pddl.syntax import (
    ActionDeclaration,
    And,
    Atom,
    DerivedDeclaration,
    DomainFragment,
    Equal,
    Formula,
    Imply,
    Not,
    Numeric,
    Or,
    ProblemFragment,
    Quantified,
    Term,
    TypedName,
    When,
)

State: TypeAlias = frozenset[tuple[str, ...]]
"""The atoms that hold, derived ones left out."""
Names: TypeAlias = Mapping[str, str]


@dataclass(frozen=True)
class Problem:
    """A domain and a problem, parsed."""

    domain: DomainFragment
    problem: ProblemFragment

    @classmethod
    def of(cls, text: Text) -> Problem:
        domain = parse_fragment(text.domain, "domain")
        problem = parse_fragment(text.problem, "problem")
        assert isinstance(domain, DomainFragment)
        assert isinstance(problem, ProblemFragment)
        return cls(domain, problem)

    @cached_property
    def objects(self) -> dict[str, frozenset[str]]:
        """Object → all types that it is of."""
        named = (*self.domain.constants, *self.problem.objects)
        return {o.name: frozenset().union(*map(self._above, o.types or ("object",))) for o in named}

    def _above(self, type_: str) -> frozenset[str]:
        found = {type_, "object"}
        while (
            more := {
                parent
                for declared in self.domain.types
                if declared.name in found
                for parent in declared.types
            }
            - found
        ):
            found |= more
        return frozenset(found)

    def bindings(self, variables: Sequence[TypedName]) -> Iterator[dict[str, str]]:
        """Every way in which variables can stand for objects."""
        fitting = [
            [name for name, types in self.objects.items() if types & {*(v.types or ("object",))}]
            for v in variables
        ]
        for values in product(*fitting):
            yield {v.name: value for v, value in zip(variables, values, strict=True)}

    @cached_property
    def start(self) -> State:
        return frozenset(_atom(fact, {}) for fact in self.problem.init if isinstance(fact, Atom))

    def holds(self, formula: Formula, names: Names, state: State) -> bool:
        """Whether a condition is true; `state` has the derived atoms too."""
        match formula:
            case Atom():
                return _atom(formula, names) in state
            case Equal():
                return _value(formula.left, names) == _value(formula.right, names)
            case Not():
                return not self.holds(formula.part, names, state)
            case And():
                return all([self.holds(part, names, state) for part in formula.parts])
            case Or():
                return any([self.holds(part, names, state) for part in formula.parts])
            case Imply():
                needed = self.holds(formula.condition, names, state)
                return not needed or self.holds(formula.part, names, state)
            case Quantified():
                every = [
                    self.holds(formula.part, {**names, **own}, state)
                    for own in self.bindings(formula.variables)
                ]
                return all(every) if formula.quantifier == "forall" else any(every)
        raise AssertionError(f"no condition: {formula}")

    def settled(self, state: State) -> State:
        """A state with what follows from it; predicates are settled in the order of their names."""
        for name in sorted({rule.name for rule in self.domain.derived}):
            rules = [rule for rule in self.domain.derived if rule.name == name]
            before = None
            while state != before:
                before = state
                state |= frozenset(self._following(rules, state))
        return state

    def _following(
        self, rules: Sequence[DerivedDeclaration], state: State
    ) -> Iterator[tuple[str, ...]]:
        for rule in rules:
            for names in self.bindings(rule.parameters):
                if self.holds(rule.condition, names, state):
                    yield _atom(rule.head, names)

    def successors(self, state: State) -> Iterator[tuple[str, State]]:
        """Every action that can be taken, by name, and where it leads."""
        whole = self.settled(state)
        for action in self.domain.actions:
            for names in self.bindings(action.parameters):
                if self.holds(action.precondition, names, whole):
                    yield _called(action, names), self._after(action.effect, names, state, whole)

    def _after(self, effect: Formula, names: Names, state: State, whole: State) -> State:
        changes = list(self._changes(effect, names, whole))
        return (state - {atom for atom, is_added in changes if not is_added}) | {
            atom for atom, is_added in changes if is_added
        }

    def _changes(
        self, effect: Formula, names: Names, state: State
    ) -> Iterator[tuple[tuple[str, ...], bool]]:
        match effect:
            case Atom():
                yield _atom(effect, names), True
            case Not(part=Atom() as atom):
                yield _atom(atom, names), False
            case And():
                for part in effect.parts:
                    yield from self._changes(part, names, state)
            case Quantified():
                for own in self.bindings(effect.variables):
                    yield from self._changes(effect.part, {**names, **own}, state)
            case When():
                if self.holds(effect.condition, names, state):
                    yield from self._changes(effect.effect, names, state)
            case Numeric():
                pass
            case _:
                raise AssertionError(f"no effect: {effect}")

    def is_reached(self, state: State) -> bool:
        """Whether the goal holds."""
        assert self.problem.goal is not None
        return self.holds(self.problem.goal, {}, self.settled(state))


def _called(action: ActionDeclaration, names: Names) -> str:
    return " ".join((action.name, *(names[parameter.name] for parameter in action.parameters)))


def _atom(atom: Atom, names: Names) -> tuple[str, ...]:
    return (atom.predicate, *(_value(term, names) for term in atom.terms))


def _value(term: Term, names: Names) -> str:
    return names.get(term.name, term.name)


class TooManyStates(Exception):
    """There are more than it is worth looking at."""


def reachable(problem: Problem, *, most: int = 5000) -> dict[State, frozenset[tuple[str, State]]]:
    """Every state that can be reached, with its successors. Raises `TooManyStates`."""
    found: dict[State, frozenset[tuple[str, State]]] = {}
    waiting = [problem.start]
    while waiting:
        state = waiting.pop()
        if state not in found:
            found[state] = frozenset(problem.successors(state))
            waiting += (after for _, after in found[state])
        if len(found) > most:
            raise TooManyStates
    return found


def distance(problem: Problem, graph: Mapping[State, frozenset[tuple[str, State]]]) -> int | None:
    """The length of a shortest plan; None if there is none."""
    seen, frontier, length = {problem.start}, [problem.start], 0
    while frontier:
        if any(problem.is_reached(state) for state in frontier):
            return length
        after = {state for before in frontier for _, state in graph[before]} - seen
        seen |= after
        frontier, length = sorted(after, key=sorted), length + 1
    return None
