"""Conditions and declarations in words that all planners agree on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from nondum.planning.pddl.normal import Condition
from nondum.planning.pddl.syntax import And, Formula, Or, Quantified, TypedName, renamed, terms_of
from nondum.planning.pddl.type_tree import TypeTree
from nondum.planning.pddl.typegraph import ROOT

Spelling: TypeAlias = Callable[[Iterable[str]], Mapping[str, str]]
"""Says how each of some names is written."""


@dataclass(slots=True)
class Wording:
    """Says conditions over one domain's types, and keeps count of what it needed for that."""

    tree: TypeTree
    types: Mapping[str, str]
    """Type → how it is spelled."""
    taken: set[str]
    """The names of predicates that are in use."""
    members: dict[tuple[str, ...], str] = field(default_factory=dict)
    """Types → the predicate, made here, that holds of what is one of them."""

    def wide(self, types: Iterable[str]) -> str:
        """A type for whatever may stand where one of `types` is asked for."""
        return self.types[self.tree.declared(types)[0] if self.tree.is_whole else ROOT]

    def declared(self, variables: Sequence[TypedName]) -> tuple[str, list[str]]:
        """Variables with their types, and what must hold of them besides."""
        words: list[str] = []
        besides: list[str] = []
        for variable in variables:
            type_, others = self.tree.declared(variable.types)
            words.append(f"{variable.name} - {self.types[type_]}")
            if others:
                besides.append(f"({self._member(others)} {variable.name})")
        return " ".join(words), besides

    def conjuncts(self, condition: Condition, around: frozenset[str]) -> list[str]:
        """The parts of a condition; `around` are the variables that mean something outside it."""
        return [self._formula(part, around) for part in condition.parts()]

    def predicate(self, name: str) -> str:
        """A name for a predicate of our own making."""
        self.taken.add(name := fresh(name, self.taken))
        return name

    def _member(self, types: tuple[str, ...]) -> str:
        if types not in self.members:
            name = f"is-{'-or-'.join(self.types[name] for name in types)}"
            self.members[types] = self.predicate(name)
        return self.members[types]

    def _formula(self, formula: Formula, around: frozenset[str]) -> str:
        match formula:
            case And(parts):
                return all_of([self._formula(part, around) for part in parts])
            case Or(parts):
                return f"(or{''.join(f' {self._formula(part, around)}' for part in parts)})"
            case Quantified():
                return self._quantified(formula, around)
            case _:
                return str(formula)

    def _quantified(self, formula: Quantified, around: frozenset[str]) -> str:
        names = apart(formula.variables, around, (formula.part,))
        variables = called(formula.variables, names)
        within = around | {variable.name for variable in variables}
        declared, besides = self.declared(variables)
        part = self._formula(renamed(formula.part, names), within)
        if besides and formula.quantifier == "exists":
            part = all_of([*besides, part])
        elif besides:
            part = f"(or {' '.join(f'(not {one})' for one in besides)} {part})"
        elif _constant(formula.part) is (formula.quantifier == "exists"):
            part = _bound(variables, formula.quantifier)
        return f"({formula.quantifier} ({declared}) {part})" if variables else part


def _constant(formula: Formula) -> bool | None:
    """What a condition is by its form alone; None where it needs an object or a fact."""
    match formula:
        case And(parts) | Or(parts):
            deciding = isinstance(formula, Or)
            values = [_constant(part) for part in parts]
            if deciding in values:
                return deciding
            return None if None in values else not deciding
        case Quantified(quantifier, variables, part):
            value = _constant(part)
            return value if not variables or value is (quantifier == "forall") else None
        case _:
            return None


def _bound(variables: Sequence[TypedName], quantifier: str) -> str:
    """What is true of all objects (`exists`) or false of all (`forall`), and names each variable.

    Fast Downward takes `(exists (?x - t) (and))` for true, also where nothing is of that type.
    """
    same = [f"(= {variable.name} {variable.name})" for variable in variables]
    if quantifier == "exists":
        return all_of(same)
    return f"(or {' '.join(f'(not {one})' for one in same)})"


def apart(
    variables: Sequence[TypedName], around: frozenset[str], parts: Iterable[Formula]
) -> dict[str, str]:
    """New names for those variables that would hide others, or that PDDL cannot write."""
    used = around | {variable.name for variable in variables}
    used |= {term.name for part in parts for term in terms_of(part)}
    names: dict[str, str] = {}
    for variable in variables:
        if variable.name in around or "'" in variable.name:
            new = fresh(variable.name.partition("'")[0], used)
            names[variable.name] = new
            used |= {new}
    return names


def called(variables: Iterable[TypedName], names: Mapping[str, str]) -> tuple[TypedName, ...]:
    """Variables by their new names."""
    return tuple(TypedName(names.get(v.name, v.name), v.types, v.place) for v in variables)


def as_it_is(names: Iterable[str]) -> dict[str, str]:
    """Names as they are; Fast Downward, for one, has nothing against dots."""
    return {name: name for name in names}


def without_dots(names: Iterable[str]) -> dict[str, str]:
    """Name → how it is written: without dots, as PDDL's grammar has it, and no two alike.

    >>> without_dots(["eye.look", "look"])
    {'look': 'look', 'eye.look': 'eye__look'}
    """
    found: dict[str, str] = {}
    for name in sorted(names, key=lambda name: ("." in name, name)):
        found[name] = fresh(name.replace(".", "__"), found.values())
    return found


def fresh(name: str, taken: Iterable[str]) -> str:
    """The name, or one like it, that is not taken.

    >>> fresh("?x", ["?x"])
    '?x_'
    """
    others = frozenset(taken)
    while name in others:
        name += "_"
    return name


def all_of(conjuncts: Sequence[str]) -> str:
    """One formula of several.

    >>> all_of([]), all_of(["(p)"]), all_of(["(p)", "(q)"])
    ('(and)', '(p)', '(and (p) (q))')
    """
    return conjuncts[0] if len(conjuncts) == 1 else f"(and{''.join(f' {c}' for c in conjuncts)})"
