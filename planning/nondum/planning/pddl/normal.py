"""Conditions in negation normal form: the literals, and whatever else must hold."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from nondum.planning.pddl.caret import Misplaced
from nondum.planning.pddl.syntax import (
    And,
    Atom,
    Equal,
    Formula,
    Imply,
    Not,
    Numeric,
    Or,
    Quantified,
    When,
    renamed,
)
from nondum.sdk.frozen import frozen


@frozen
class Condition:
    """A conjunction: all of these hold."""

    positive: tuple[Atom, ...] = ()
    negative: tuple[Atom, ...] = ()
    """Atoms that are false."""
    equal: tuple[Equal, ...] = ()
    unequal: tuple[Equal, ...] = ()
    further: tuple[Or | Quantified, ...] = ()
    """The parts that are no literals; in them `not` stands before atoms and equalities only."""

    def pairs(self) -> tuple[Equal, ...]:
        """The terms it compares, outside `further`."""
        return self.equal + self.unequal

    def parts(self) -> Iterator[Formula]:
        """What it is the conjunction of."""
        yield from self.positive
        yield from (Not(atom, atom.place) for atom in self.negative)
        yield from self.equal
        yield from (Not(pair, pair.place) for pair in self.unequal)
        yield from self.further

    def bound(self, names: Mapping[str, str]) -> Condition:
        """The same with terms replaced by others' names; those not in `names` stay."""
        return joined(_literals(renamed(part, names)) for part in self.parts())


def condition_of(formula: Formula) -> Condition:
    """Read a condition. Raises `Misplaced` (PDDL_UNSUPPORTED, PDDL_MISPLACED)."""
    return _literals(normal(formula))


def normal(formula: Formula, *, negated: bool = False) -> Formula:
    """A condition, or its negation, made of literals, `and`, `or` and quantifiers.

    Raises `Misplaced` (PDDL_UNSUPPORTED, PDDL_MISPLACED).
    """
    match formula:
        case Atom() | Equal():
            return Not(formula, formula.place) if negated else formula
        case Not():
            return normal(formula.part, negated=not negated)
        case And() | Or():
            parts = tuple(normal(part, negated=negated) for part in formula.parts)
            kind = And if isinstance(formula, And) is not negated else Or
            return kind(parts, formula.place)
        case Imply():
            either = Or((Not(formula.condition, formula.place), formula.part), formula.place)
            return normal(either, negated=negated)
        case Quantified():
            part = normal(formula.part, negated=negated)
            others = {"forall": "exists", "exists": "forall"}
            quantifier = others[formula.quantifier] if negated else formula.quantifier
            return Quantified(quantifier, formula.variables, part, formula.place)
        case When():
            message = "'when' belongs in an effect; a condition says 'imply'"
            raise Misplaced("PDDL_MISPLACED", message, formula.place)
        case Numeric():
            message = f"the numeric condition {formula} is not handled"
            raise Misplaced("PDDL_UNSUPPORTED", message, formula.place)


def _literals(formula: Formula) -> Condition:
    match formula:
        case Atom():
            return Condition(positive=(formula,))
        case Not(part=Atom() as atom):
            return Condition(negative=(atom,))
        case Equal():
            return Condition(equal=(formula,))
        case Not(part=Equal() as pair):
            return Condition(unequal=(pair,))
        case And():
            return joined(map(_literals, formula.parts))
        case Or(parts=(only,)):
            return _literals(only)
        case Quantified(variables=()):
            return _literals(formula.part)
        case Or() | Quantified():
            return Condition(further=(formula,))
    raise AssertionError(f"not in normal form: {formula}")


def joined(conditions: Iterable[Condition]) -> Condition:
    """All of several conditions."""
    found = tuple(conditions)
    return Condition(
        positive=unique(atom for condition in found for atom in condition.positive),
        negative=unique(atom for condition in found for atom in condition.negative),
        equal=tuple(pair for condition in found for pair in condition.equal),
        unequal=tuple(pair for condition in found for pair in condition.unequal),
        further=tuple(part for condition in found for part in condition.further),
    )


def unique(atoms: Iterable[Atom]) -> tuple[Atom, ...]:
    """Each once, in the order they came in."""
    return tuple(dict.fromkeys(atoms))


def atoms_in(formula: Formula) -> Iterator[tuple[Atom, bool]]:
    """The atoms of a normal condition, and whether each must be true."""
    match formula:
        case Atom():
            yield formula, True
        case Not(part=Atom() as atom):
            yield atom, False
        case And() | Or():
            for part in formula.parts:
                yield from atoms_in(part)
        case Quantified():
            yield from atoms_in(formula.part)


def quantified_in(formula: Formula) -> Iterator[str]:
    """The variables that a normal condition binds."""
    match formula:
        case And() | Or():
            for part in formula.parts:
                yield from quantified_in(part)
        case Quantified():
            yield from (variable.name for variable in formula.variables)
            yield from quantified_in(formula.part)
