"""Conditions and effects as sets of literals; what does not fit that form is refused by name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
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
    Term,
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

    def pairs(self) -> tuple[Equal, ...]:
        """The terms it compares."""
        return self.equal + self.unequal

    def terms(self) -> Iterator[Term]:
        """Every term in it."""
        for atom in self.atoms():
            yield from atom.terms
        for pair in self.pairs():
            yield from (pair.left, pair.right)

    def bound(self, names: Mapping[str, str]) -> Condition:
        """The same with terms replaced by others' names; those not in `names` stay."""
        return Condition(
            tuple(_bound_atom(atom, names) for atom in self.positive),
            tuple(_bound_atom(atom, names) for atom in self.negative),
            tuple(_bound_pair(pair, names) for pair in self.equal),
            tuple(_bound_pair(pair, names) for pair in self.unequal),
        )


def _bound_term(term: Term, names: Mapping[str, str]) -> Term:
    return Term(names.get(term.name, term.name), term.place)


def _bound_atom(atom: Atom, names: Mapping[str, str]) -> Atom:
    terms = tuple(_bound_term(term, names) for term in atom.terms)
    return Atom(atom.predicate, terms, atom.place)


def _bound_pair(pair: Equal, names: Mapping[str, str]) -> Equal:
    return Equal(_bound_term(pair.left, names), _bound_term(pair.right, names), pair.place)


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
