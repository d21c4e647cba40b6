"""The parts of a PDDL text, each with the place it was written at.

Source: PDDL 2.1 (Fox and Long 2003), the BNF of PDDL 3.1 for typing. Two parts compare equal when
they say the same; where they were written does not count.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import TypeAlias

from nondum.sdk.frozen import frozen


@frozen
class Place:
    """Where something is written."""

    file: str
    line: int
    """From 1."""
    column: int
    """From 1."""

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@frozen
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


@frozen
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


@frozen
class Atom:
    """`(predicate term …)`."""

    predicate: str
    terms: tuple[Term, ...]
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"({' '.join((self.predicate, *(term.name for term in self.terms)))})"


@frozen
class Equal:
    """`(= left right)` between terms."""

    left: Term
    right: Term
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(= {self.left} {self.right})"


@frozen
class Not:
    """`(not part)`."""

    part: Formula
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(not {self.part})"


@frozen
class And:
    """`(and part …)`; without parts it is true, and changes nothing."""

    parts: tuple[Formula, ...]
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(and{''.join(f' {part}' for part in self.parts)})"


@frozen
class Or:
    """`(or part …)`; without parts it is false."""

    parts: tuple[Formula, ...]
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(or{''.join(f' {part}' for part in self.parts)})"


@frozen
class Imply:
    """`(imply condition part)`."""

    condition: Formula
    part: Formula
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(imply {self.condition} {self.part})"


@frozen
class Quantified:
    """`(forall (variables) part)` or `(exists (variables) part)`."""

    quantifier: str
    """`forall` or `exists`."""
    variables: tuple[TypedName, ...]
    part: Formula
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"({self.quantifier} ({' '.join(map(str, self.variables))}) {self.part})"


@frozen
class When:
    """`(when condition effect)`."""

    condition: Formula
    effect: Formula
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"(when {self.condition} {self.effect})"


@frozen
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


def renamed(formula: Formula, names: Mapping[str, str]) -> Formula:
    """A formula with terms replaced by others' names; those not in `names` and variables that are
    bound inside stay."""
    match formula:
        case Atom():
            return renamed_atom(formula, names)
        case Equal():
            return Equal(_term(formula.left, names), _term(formula.right, names), formula.place)
        case Not():
            return Not(renamed(formula.part, names), formula.place)
        case And() | Or():
            parts = tuple(renamed(part, names) for part in formula.parts)
            return type(formula)(parts, formula.place)
        case Imply():
            condition = renamed(formula.condition, names)
            return Imply(condition, renamed(formula.part, names), formula.place)
        case When():
            condition = renamed(formula.condition, names)
            return When(condition, renamed(formula.effect, names), formula.place)
        case Quantified():
            own = {variable.name for variable in formula.variables}
            free = {name: to for name, to in names.items() if name not in own}
            part = renamed(formula.part, free)
            return Quantified(formula.quantifier, formula.variables, part, formula.place)
        case Numeric():
            left, right = _value(formula.left, names), _value(formula.right, names)
            return Numeric(formula.operator, left, right, formula.place)


def renamed_atom(atom: Atom, names: Mapping[str, str]) -> Atom:
    """An atom with terms replaced by others' names; those not in `names` stay."""
    return Atom(atom.predicate, tuple(_term(term, names) for term in atom.terms), atom.place)


def _term(term: Term, names: Mapping[str, str]) -> Term:
    return Term(names.get(term.name, term.name), term.place)


def _value(value: Atom | Term | float, names: Mapping[str, str]) -> Atom | Term | float:
    match value:
        case Atom():
            return renamed_atom(value, names)
        case Term():
            return _term(value, names)
        case _:
            return value


@frozen
class PredicateDeclaration:
    """`(predicate ?parameter - type …)`, also used for functions."""

    name: str
    parameters: tuple[TypedName, ...]
    place: Place = field(compare=False)

    def __str__(self) -> str:
        return f"({' '.join((self.name, *map(str, self.parameters)))})"


@frozen
class ActionDeclaration:
    """`(:action name :parameters … :precondition … :effect …)`."""

    name: str
    parameters: tuple[TypedName, ...]
    precondition: Formula
    effect: Formula
    place: Place = field(compare=False)


@frozen
class DerivedDeclaration:
    """`(:derived (predicate ?x - type …) condition)`: holds wherever the condition does."""

    name: str
    parameters: tuple[TypedName, ...]
    condition: Formula
    place: Place = field(compare=False)

    @property
    def head(self) -> Atom:
        """What follows from the condition."""
        terms = tuple(Term(parameter.name, parameter.place) for parameter in self.parameters)
        return Atom(self.name, terms, self.place)


@frozen
class DomainFragment:
    """What one `(define (domain …) …)` says."""

    name: str
    file: str
    types: tuple[TypedName, ...] = ()
    """Their `types` are the parents claimed."""
    constants: tuple[TypedName, ...] = ()
    predicates: tuple[PredicateDeclaration, ...] = ()
    functions: tuple[PredicateDeclaration, ...] = ()
    valued: tuple[TypedName, ...] = ()
    """Names of predicates that carry a value beside the fact, and of which type of message it is,
    where that is said: `(:valued bearing-known - bearing)`."""
    functional: tuple[Term, ...] = ()
    """Names of predicates with one last argument for each of the others: `(:functional at)`."""
    derived: tuple[DerivedDeclaration, ...] = ()
    actions: tuple[ActionDeclaration, ...] = ()


@frozen
class ProblemFragment:
    """What one `(define (problem …) …)` says."""

    name: str
    file: str
    domain: str
    objects: tuple[TypedName, ...] = ()
    init: tuple[Formula, ...] = ()
    goal: Formula | None = None
    metric: str = ""
    """What is to be minimised: `total-cost`, or nothing said."""


FragmentSyntax: TypeAlias = DomainFragment | ProblemFragment
