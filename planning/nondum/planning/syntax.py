"""The parts of a PDDL text, each with the place it was written at.

Source: PDDL 2.1 (Fox and Long 2003), the BNF of PDDL 3.1 for typing. Two parts compare equal when
they say the same; where they were written does not count.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class Place:
    """Where something is written."""

    file: str
    line: int
    """From 1."""
    column: int
    """From 1."""

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Term:
    """A variable (`?x`) or the name of an object."""

    name: str
    place: Place = field(compare=False)

    @property
    def is_variable(self) -> bool:
        """Whether it stands for an object instead of naming one."""
        return self.name.startswith("?")

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True)
class TypedName:
    """A name that is declared, with the types claimed for it; several of them mean `either`."""

    name: str
    types: tuple[str, ...]
    """Empty: no claim was made (`object`, where one is needed)."""
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"{self.name} - {type_text(self.types)}" if self.types else self.name


def type_text(types: tuple[str, ...]) -> str:
    """Write types as PDDL does.

    >>> type_text(("image", "depth"))
    '(either image depth)'
    """
    return types[0] if len(types) == 1 else f"(either {' '.join(types)})"


@dataclass(frozen=True, slots=True)
class Atom:
    """`(predicate term …)`."""

    predicate: str
    terms: tuple[Term, ...]
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"({' '.join((self.predicate, *(term.name for term in self.terms)))})"


@dataclass(frozen=True, slots=True)
class Equal:
    """`(= left right)` between terms."""

    left: Term
    right: Term
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(= {self.left} {self.right})"


@dataclass(frozen=True, slots=True)
class Not:
    """`(not part)`."""

    part: Formula
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(not {self.part})"


@dataclass(frozen=True, slots=True)
class And:
    """`(and part …)`; without parts it is true, and changes nothing."""

    parts: tuple[Formula, ...]
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(and{''.join(f' {part}' for part in self.parts)})"


@dataclass(frozen=True, slots=True)
class Or:
    """`(or part …)`; without parts it is false."""

    parts: tuple[Formula, ...]
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(or{''.join(f' {part}' for part in self.parts)})"


@dataclass(frozen=True, slots=True)
class Imply:
    """`(imply condition part)`."""

    condition: Formula
    part: Formula
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(imply {self.condition} {self.part})"


@dataclass(frozen=True, slots=True)
class Quantified:
    """`(forall (variables) part)` or `(exists (variables) part)`."""

    quantifier: str
    """`forall` or `exists`."""
    variables: tuple[TypedName, ...]
    part: Formula
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"({self.quantifier} ({' '.join(map(str, self.variables))}) {self.part})"


@dataclass(frozen=True, slots=True)
class When:
    """`(when condition effect)`."""

    condition: Formula
    effect: Formula
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(when {self.condition} {self.effect})"


@dataclass(frozen=True, slots=True)
class Numeric:
    """A comparison or change of numbers: `(increase (total-cost) 3)`, `(>= (fuel ?u) 1)`."""

    operator: str
    left: Atom | Term | float
    right: Atom | Term | float
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"({self.operator} {_value_text(self.left)} {_value_text(self.right)})"


Formula: TypeAlias = Atom | Equal | Not | And | Or | Imply | Quantified | When | Numeric
"""A condition or an effect; which parts are allowed in which is checked after parsing."""


def _value_text(value: Atom | Term | float) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def terms_of(formula: Formula) -> Iterator[Term]:
    """Every term in a formula, in the order they are written."""
    match formula:
        case Atom():
            yield from formula.terms
        case Equal():
            yield from (formula.left, formula.right)
        case Not() | Quantified():
            yield from terms_of(formula.part)
        case And() | Or():
            for part in formula.parts:
                yield from terms_of(part)
        case Imply():
            yield from terms_of(formula.condition)
            yield from terms_of(formula.part)
        case When():
            yield from terms_of(formula.condition)
            yield from terms_of(formula.effect)
        case Numeric():
            for value in (formula.left, formula.right):
                if isinstance(value, Term):
                    yield value
                elif isinstance(value, Atom):
                    yield from value.terms


@dataclass(frozen=True, slots=True)
class PredicateDeclaration:
    """`(predicate ?parameter - type …)`, also used for functions."""

    name: str
    parameters: tuple[TypedName, ...]
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"({' '.join((self.name, *map(str, self.parameters)))})"


@dataclass(frozen=True, slots=True)
class ActionDeclaration:
    """`(:action name :parameters … :precondition … :effect …)`."""

    name: str
    parameters: tuple[TypedName, ...]
    precondition: Formula
    effect: Formula
    place: Place = field(compare=False)


@dataclass(frozen=True, slots=True)
class DomainFragment:
    """What one `(define (domain …) …)` says."""

    name: str
    file: str
    types: tuple[TypedName, ...] = ()
    """Their `types` are the parents claimed."""
    constants: tuple[TypedName, ...] = ()
    predicates: tuple[PredicateDeclaration, ...] = ()
    functions: tuple[PredicateDeclaration, ...] = ()
    valued: tuple[Term, ...] = ()
    """Names of predicates that carry a value beside the fact: `(:valued bearing-known)`."""
    functional: tuple[Term, ...] = ()
    """Names of predicates with one last argument for each of the others: `(:functional at)`."""
    actions: tuple[ActionDeclaration, ...] = ()


@dataclass(frozen=True, slots=True)
class ProblemFragment:
    """What one `(define (problem …) …)` says."""

    name: str
    file: str
    domain: str
    objects: tuple[TypedName, ...] = ()
    init: tuple[Formula, ...] = ()
    goal: Formula | None = None


FragmentSyntax: TypeAlias = DomainFragment | ProblemFragment
