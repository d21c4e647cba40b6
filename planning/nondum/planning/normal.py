"""Conditions and effects as sets of literals; what does not fit that form is refused by name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from nondum.planning.caret import Misplaced
from nondum.planning.syntax import (
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
)


@dataclass(frozen=True, slots=True)
class Condition:
    """A conjunction: all of these hold."""

    positive: tuple[Atom, ...] = ()
    negative: tuple[Atom, ...] = ()
    """Atoms that are false."""
    equal: tuple[Equal, ...] = ()
    unequal: tuple[Equal, ...] = ()

    def atoms(self) -> tuple[Atom, ...]:
        """The atoms it reads, whether true or false."""
        return self.positive + self.negative


@dataclass(frozen=True, slots=True)
class Effect:
    """What changes, and what it costs."""

    add: tuple[Atom, ...] = ()
    delete: tuple[Atom, ...] = ()
    cost: int = 1

    def atoms(self) -> tuple[Atom, ...]:
        """The atoms it writes, whether true or false."""
        return self.add + self.delete


def condition_of(formula: Formula) -> Condition:
    """Read a condition. Raises `Misplaced` (E-UNSUPPORTED, E-MISPLACED)."""
    return _condition(formula, negated=False)


def _condition(formula: Formula, *, negated: bool) -> Condition:
    match formula:
        case Atom():
            return Condition(negative=(formula,)) if negated else Condition(positive=(formula,))
        case Equal():
            return Condition(unequal=(formula,)) if negated else Condition(equal=(formula,))
        case Not():
            return _condition(formula.part, negated=not negated)
        case And() | Or() if len(formula.parts) == 1 or isinstance(formula, Or) is negated:
            return _joined(_condition(part, negated=negated) for part in formula.parts)
        case When():
            message = "'when' belongs in an effect; a condition says 'imply'"
            raise Misplaced("E-MISPLACED", message, formula.place)
    raise _unsupported(formula)


def _joined(conditions: Iterable[Condition]) -> Condition:
    found = tuple(conditions)
    return Condition(
        positive=_unique(atom for condition in found for atom in condition.positive),
        negative=_unique(atom for condition in found for atom in condition.negative),
        equal=tuple(pair for condition in found for pair in condition.equal),
        unequal=tuple(pair for condition in found for pair in condition.unequal),
    )


def effect_of(formula: Formula) -> Effect:
    """Read an effect. An action that names no cost costs 1.

    Raises `Misplaced` (E-UNSUPPORTED, E-MISPLACED).
    """
    added: list[Atom] = []
    deleted: list[Atom] = []
    costs: list[int] = []
    for part in _effects(formula):
        match part:
            case Atom():
                added.append(part)
            case Not(part=Atom() as atom):
                deleted.append(atom)
            case Numeric():
                costs.append(_cost(part))
            case Equal() | Imply() | Or() | Not() | Quantified(quantifier="exists"):
                raise Misplaced("E-MISPLACED", f"{_called(part)} is not an effect", part.place)
            case _:
                raise _unsupported(part)
    cost = sum(costs) if costs else 1
    return Effect(_unique(added), _unique(deleted), cost)


def _effects(formula: Formula) -> Iterable[Formula]:
    if not isinstance(formula, And):
        return (formula,)
    return (effect for part in formula.parts for effect in _effects(part))


def _cost(effect: Numeric) -> int:
    match effect:
        case Numeric(operator="increase", left=Atom(predicate="total-cost"), right=float(cost)):
            if cost == int(cost):
                return int(cost)
    message = f"numeric effect {effect} is not handled, only whole constants added to total-cost"
    raise Misplaced("E-UNSUPPORTED", message, effect.place)


def _unique(atoms: Iterable[Atom]) -> tuple[Atom, ...]:
    return tuple(dict.fromkeys(atoms))


def _unsupported(formula: Formula) -> Misplaced:
    return Misplaced("E-UNSUPPORTED", f"{_called(formula)} is not handled", formula.place)


def _called(formula: Formula) -> str:
    match formula:
        case And():
            return "a negated conjunction"
        case Or():
            return "'or'"
        case Quantified():
            return f"'{formula.quantifier}'"
        case Imply():
            return "'imply'"
        case When():
            return "'when'"
        case Equal():
            return "'='"
        case Numeric():
            return f"the numeric condition {formula}"
        case _:
            return str(formula)
