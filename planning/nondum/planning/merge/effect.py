"""Effects as sets of atoms: what changes always, what changes under a condition, what it costs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from nondum.planning.pddl.caret import Misplaced
from nondum.planning.pddl.normal import Condition, condition_of, joined, unique
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
    TypedName,
    When,
    renamed,
)
from nondum.sdk.frozen import frozen


@frozen
class ConditionalChange:
    """Changes for every binding of `variables` for which the condition holds."""

    variables: tuple[TypedName, ...]
    condition: Condition
    add: tuple[Atom, ...] = ()
    delete: tuple[Atom, ...] = ()

    def atoms(self) -> tuple[Atom, ...]:
        """The atoms it writes, whether true or false."""
        return self.add + self.delete


@frozen
class Effect:
    """What changes, and what it costs."""

    add: tuple[Atom, ...] = ()
    delete: tuple[Atom, ...] = ()
    cost: int = 1
    """The part of the cost that is the same for all bindings."""
    cost_functions: tuple[Atom, ...] = ()
    """Functions of the parameters whose values are added to it."""
    conditional: tuple[ConditionalChange, ...] = ()

    def added(self) -> Iterator[Atom]:
        """The atoms it may make true."""
        yield from self.add
        for change in self.conditional:
            yield from change.add

    def deleted(self) -> Iterator[Atom]:
        """The atoms it may make false."""
        yield from self.delete
        for change in self.conditional:
            yield from change.delete


def effect_of(formula: Formula, parameters: Iterable[str] = (), *, unnamed_cost: int = 1) -> Effect:
    """Read an effect of an action with `parameters`. One that names no cost has `unnamed_cost`.

    Quantified variables that hide others are renamed. Raises `Misplaced` (PDDL_UNSUPPORTED,
    PDDL_MISPLACED).
    """
    found = _Reading(frozenset(parameters))
    found.read(formula, _Where())
    cost, functions = found.cost() if found.increases else (unnamed_cost, ())
    plain = found.changes.pop(_Where(), _Change())
    return Effect(
        add=unique(plain.add),
        delete=unique(plain.delete),
        cost=cost,
        cost_functions=functions,
        conditional=tuple(
            ConditionalChange(where.variables, where.condition, tuple(c.add), tuple(c.delete))
            for where, c in found.changes.items()
        ),
    )


@frozen
class _Where:
    """For which bindings, and under which condition."""

    variables: tuple[TypedName, ...] = ()
    condition: Condition = field(default_factory=Condition)


@dataclass(slots=True)
class _Change:
    add: list[Atom] = field(default_factory=list)
    delete: list[Atom] = field(default_factory=list)


@dataclass(slots=True)
class _Reading:
    parameters: frozenset[str]
    changes: dict[_Where, _Change] = field(default_factory=dict)
    increases: list[Numeric] = field(default_factory=list)

    def read(self, formula: Formula, where: _Where) -> None:
        match formula:
            case Atom():
                self.changes.setdefault(where, _Change()).add.append(formula)
            case Not(part=Atom() as atom):
                self.changes.setdefault(where, _Change()).delete.append(atom)
            case And():
                for part in formula.parts:
                    self.read(part, where)
            case Quantified(quantifier="forall"):
                variables, part = self._apart(formula, where)
                self.read(part, replace(where, variables=(*where.variables, *variables)))
            case When():
                both = joined((where.condition, condition_of(formula.condition)))
                self.read(formula.effect, replace(where, condition=both))
            case Numeric() if where == _Where():
                self.increases.append(formula)
            case Numeric():
                message = "a cost that depends on a condition is not handled"
                raise Misplaced("PDDL_UNSUPPORTED", message, formula.place)
            case _:
                message = f"{_called(formula)} is not an effect"
                raise Misplaced("PDDL_MISPLACED", message, formula.place)

    def _apart(self, formula: Quantified, where: _Where) -> tuple[tuple[TypedName, ...], Formula]:
        """The variables and the part, renamed where they would hide others."""
        taken = self.parameters | {variable.name for variable in where.variables}
        hiding = {v.name: f"{v.name}'{len(taken)}" for v in formula.variables if v.name in taken}
        if not hiding:
            return formula.variables, formula.part
        variables = (replace(v, name=hiding.get(v.name, v.name)) for v in formula.variables)
        return tuple(variables), renamed(formula.part, hiding)

    def cost(self) -> tuple[int, tuple[Atom, ...]]:
        cost = 0
        functions: list[Atom] = []
        for increase in self.increases:
            match increase:
                case Numeric("increase", Atom("total-cost"), float(value)) if is_exact(value):
                    cost += int(value)
                case Numeric("increase", Atom("total-cost"), Atom() as function):
                    functions.append(function)
                case _:
                    message = (
                        f"numeric effect {increase} is not handled,"
                        " only whole numbers below 2^53 and functions added to total-cost"
                    )
                    raise Misplaced("PDDL_UNSUPPORTED", message, increase.place)
        return cost, tuple(functions)


def is_exact(value: float) -> bool:
    """Whether a number is whole, and so small that it is the one that was written.

    >>> is_exact(3.0), is_exact(0.5), is_exact(1e17), is_exact(float("inf"))
    (True, False, False, False)
    """
    return value.is_integer() and value < 2**53


def _called(formula: Formula) -> str:
    match formula:
        case Or():
            return "'or'"
        case Quantified():
            return f"'{formula.quantifier}'"
        case Imply():
            return "'imply'"
        case Equal():
            return "'='"
        case _:
            return str(formula)
