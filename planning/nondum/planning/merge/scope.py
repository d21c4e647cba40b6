"""What the names in one component's fragments mean, and the problems found on the way.

A fragment may use the core's words, those that the fragments of the same component declare, and
nothing else: so a component that leaves takes no meaning away from the rest.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from nondum.planning.merge.core import HOST_PREDICATES, TAKEN_PREDICATES
from nondum.planning.merge.domain import Origin, Predicate
from nondum.planning.merge.effect import Effect
from nondum.planning.pddl.caret import nearest, refusal
from nondum.planning.pddl.syntax import (
    And,
    Atom,
    Equal,
    Formula,
    Imply,
    Not,
    Numeric,
    Or,
    Place,
    Quantified,
    Term,
    TypedName,
    When,
    type_text,
)
from nondum.planning.pddl.typegraph import ROOT, TypeGraph, types_or_root
from nondum.sdk.errors import Problem

SELF = "self"
"""What fragments and goals call the host."""

OWNED_MARK = "__"
"""Only names of units and streams contain it."""


Variables: TypeAlias = Mapping[str, tuple[str, ...]]
"""The variables that may be used, with their types."""

PROBLEMS_LIMIT = 50
"""Problems of one component that are told at once, at most."""


class TooManyProblems(Exception):
    """The report is full; the rest is not worth looking at."""


@dataclass(slots=True)
class Report:
    """Collects everything wrong with one component, so that a person reads it all at once."""

    by: Origin
    texts: Mapping[str, str]
    """File name → text, for the lines that problems show."""
    problems: list[Problem] = field(default_factory=list)
    warnings: list[Problem] = field(default_factory=list)

    def problem(self, code: str, message: str, place: Place, fix: str = "") -> None:
        """Something that keeps the component out. Raises `TooManyProblems` after enough of them."""
        self.problems.append(self._at(code, message, place, fix))
        if len(self.problems) >= PROBLEMS_LIMIT:
            raise TooManyProblems

    def warning(self, code: str, message: str, place: Place, fix: str = "") -> None:
        """Something that a person should know."""
        self.warnings.append(self._at(code, message, place, fix))

    def origin(self, place: Place) -> Origin:
        """The component, at a place."""
        return Origin(self.by.component, self.by.plugin, self.by.version, place)

    def signed(self, problem: Problem) -> Problem:
        """A problem found in one text, with the plugin that brought it."""
        return replace(problem, where=f"{self.by} {problem.where}")

    def _at(self, code: str, message: str, place: Place, fix: str) -> Problem:
        text = self.texts.get(place.file, "")
        return refusal(code, message, place, text, by=str(self.by), fix=fix)


@dataclass(slots=True)
class Scope:
    """Names of one component: the core's and its own. Checks add to the report."""

    report: Report
    host: str
    locals: Mapping[str, str]
    """The component's own units and slots: local name → object."""
    graph: TypeGraph
    predicates: dict[str, Predicate] = field(default_factory=dict)
    objects: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Object → types."""
    functions: dict[str, Predicate] = field(default_factory=dict)
    of_host: frozenset[str] = HOST_PREDICATES
    """The predicates that are the host's to say."""

    def resolve(self, name: str) -> str:
        """The object that a local name, `self` or a shared name stands for."""
        return self.host if name == SELF else self.locals.get(name, name)

    def checked_types(self, names: Iterable[TypedName]) -> tuple[TypedName, ...]:
        """The names, their types checked (PDDL_UNKNOWN).

        What is of an undeclared type counts as an object, so that one mistake is told once.
        """
        return tuple(
            name if self._are_types(name.types, name.place) else replace(name, types=(ROOT,))
            for name in names
        )

    def _are_types(self, types: Iterable[str], place: Place) -> bool:
        unknown = [name for name in types if name not in self.graph]
        for name in unknown:
            fix = nearest(name, self.graph.parents) or "declare it in :types"
            self.report.problem("PDDL_UNKNOWN", f"type {name!r} is not declared", place, fix)
        return not unknown

    def check_formula(self, formula: Formula, variables: Variables) -> None:
        """Check each name of a formula: PDDL_UNKNOWN, PDDL_ARITY, PDDL_TYPE, PDDL_TWICE."""
        match formula:
            case Atom():
                self.check_atom(formula, variables)
            case Equal():
                for term in (formula.left, formula.right):
                    self.check_term(term, (ROOT,), variables)
            case Not():
                self.check_formula(formula.part, variables)
            case And() | Or():
                for part in formula.parts:
                    self.check_formula(part, variables)
            case Imply():
                self.check_formula(formula.condition, variables)
                self.check_formula(formula.part, variables)
            case When():
                self.check_formula(formula.condition, variables)
                self.check_formula(formula.effect, variables)
            case Quantified():
                checked = self.checked_types(formula.variables)
                own = {variable.name: types_or_root(variable.types) for variable in checked}
                self.check_formula(formula.part, {**variables, **own})
            case Numeric(right=Atom() as function):
                self.check_function(function, variables)

    def check_atom(self, atom: Atom, variables: Variables) -> bool:
        """Check predicate, arity, names and types: PDDL_UNKNOWN, PDDL_ARITY, PDDL_TYPE."""
        return self._check_use(atom, "predicate", self.predicates, variables)

    def check_function(self, atom: Atom, variables: Variables) -> bool:
        """Check the use of a function as that of a predicate."""
        return self._check_use(atom, "function", self.functions, variables)

    def _check_use(
        self, atom: Atom, kind: str, declared: Mapping[str, Predicate], variables: Variables
    ) -> bool:
        predicate = declared.get(atom.predicate)
        if predicate is None:
            fix = nearest(atom.predicate, declared) or f"declare it in :{kind}s"
            message = f"{kind} {atom.predicate!r} is not declared"
            self.report.problem("PDDL_UNKNOWN", message, atom.place, fix)
            return False
        if len(atom.terms) != predicate.arity:
            message = f"{atom} has {len(atom.terms)} arguments, {_declared(predicate)}"
            self.report.problem("PDDL_ARITY", message, atom.place)
            return False
        return all(
            [
                self.check_term(term, types, variables)
                for term, types in zip(atom.terms, predicate.parameters, strict=True)
            ]
        )

    def check_term(self, term: Term, types: tuple[str, ...], variables: Variables) -> bool:
        """Check that a term is something of one of `types` (PDDL_UNKNOWN, PDDL_TYPE)."""
        found = variables.get(term.name) or self.objects.get(self.resolve(term.name))
        if found is None:
            if term.is_variable:
                message = f"{term} is not a parameter"
                fix = nearest(term.name, variables)
            else:
                message = f"{term.name!r} is not declared"
                fix = nearest(term.name, [*self.objects, *self.locals, SELF])
            self.report.problem("PDDL_UNKNOWN", message, term.place, fix)
            return False
        if not self.graph.may_be(found, types):
            message = f"expected {type_text(types)}, {term} is {type_text(found)}"
            self.report.problem("PDDL_TYPE", message, term.place)
            return False
        return True

    def check_ownership(self, effect: Effect, *, lasting: bool) -> None:
        """Check that an effect writes nothing that is the host's (PDDL_OWNED).

        A lasting action may delete `idle` and `free`: so it takes them for as long as it runs.
        """
        for atom in effect.added():
            self.check_writable(atom)
        for atom in effect.deleted():
            if atom.predicate not in TAKEN_PREDICATES:
                self.check_writable(atom)
            elif not lasting:
                message = f"only a lasting behaviour may take {atom}"
                fix = "make the behaviour lasting, or leave the effect out"
                self.report.problem("PDDL_OWNED", message, atom.place, fix)

    def check_writable(self, atom: Atom) -> None:
        """Check that a plugin may write an atom (PDDL_OWNED)."""
        if atom.predicate in self.of_host:
            message = f"{atom.predicate!r} is the host's to say; plugins may only read it"
            self.report.problem("PDDL_OWNED", message, atom.place)


def _declared(predicate: Predicate) -> str:
    signature = " ".join(f"?{i} - {type_text(t)}" for i, t in enumerate(predicate.parameters, 1))
    return f"({' '.join(filter(None, (predicate.name, signature)))}) is declared"
