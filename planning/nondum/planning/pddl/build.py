"""From lark's trees to nondum's syntax, with the checks that a grammar cannot make.

A list such as `a b - robot c` arrives flat, as names and `- type` markers in the order they were
written, since a grammar with one token of lookahead cannot group it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from lark import Token, Transformer

from nondum.planning.pddl.caret import Misplaced
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
    Place,
    PredicateDeclaration,
    ProblemFragment,
    Quantified,
    Term,
    TypedName,
    When,
)
from nondum.sdk.frozen import frozen


@frozen
class _OfType:
    """`- type`, closing a run of names."""

    types: tuple[str, ...]
    place: Place


@frozen
class _Section:
    """One section of a domain, problem or action."""

    kind: str
    content: Any
    place: Place


class Builder(Transformer[Token, Any]):
    """Makes syntax of what is parsed, bottom up. Raises `Misplaced`."""

    file = ""
    """The name that places give."""

    def __init__(self) -> None:
        super().__init__(visit_tokens=False)

    def _place(self, token: Token) -> Place:
        return Place(self.file, token.line or 1, token.column or 1)

    # Names and terms

    def term(self, children: list[Token]) -> Term:
        return Term(str(children[0]), self._place(children[0]))

    def of_type(self, children: list[Token]) -> _OfType:
        return _OfType(tuple(map(str, children)), self._place(children[0]))

    def declaration(self, children: list[Any]) -> PredicateDeclaration:
        name, *parameters = children
        return PredicateDeclaration(str(name), self._typed(parameters), self._place(name))

    signature = declaration

    def _typed(self, items: Iterable[Token | _OfType]) -> tuple[TypedName, ...]:
        typed: list[TypedName] = []
        waiting: list[Token] = []
        for item in items:
            if isinstance(item, _OfType):
                if not waiting:
                    raise Misplaced("PDDL_SYNTAX", "expected a name before '-'", item.place)
                typed += (TypedName(str(t), item.types, self._place(t)) for t in waiting)
                waiting = []
            else:
                waiting.append(item)
        return (*typed, *(TypedName(str(token), (), self._place(token)) for token in waiting))

    def _variables(self, items: Iterable[Token | _OfType]) -> tuple[TypedName, ...]:
        variables = self._typed(items)
        _refuse_repeated(variables, "variable")
        return variables

    # Formulas

    def nothing(self, children: list[Token]) -> And:
        return And((), self._place(children[0]))

    def conjunction(self, children: list[Any]) -> And:
        return And(tuple(children[1:]), self._place(children[0]))

    def disjunction(self, children: list[Any]) -> Or:
        return Or(tuple(children[1:]), self._place(children[0]))

    def negation(self, children: list[Any]) -> Not:
        return Not(children[1], self._place(children[0]))

    def implication(self, children: list[Any]) -> Imply:
        return Imply(children[1], children[2], self._place(children[0]))

    def quantified(self, children: list[Any]) -> Quantified:
        word, *variables, part = children
        return Quantified(str(word), self._variables(variables), part, self._place(word))

    def conditional(self, children: list[Any]) -> When:
        return When(children[1], children[2], self._place(children[0]))

    def numeric(self, children: list[Any]) -> Equal | Numeric:
        sign, *values = children
        left, right = (float(v) if isinstance(v, Token) else v for v in values)
        if sign == "=" and isinstance(left, Term) and isinstance(right, Term):
            return Equal(left, right, self._place(sign))
        return Numeric(str(sign), left, right, self._place(sign))

    def atom(self, children: list[Any]) -> Atom:
        name, *terms = children
        return Atom(str(name), tuple(terms), self._place(name))

    def formula(self, children: list[Formula]) -> Formula:
        return children[0]

    # Sections

    def _named(self, children: list[Any]) -> _Section:
        return self._section(children, self._typed(children[1:]))

    types = constants = objects = valued = _named

    def _listed(self, children: list[Any]) -> _Section:
        return self._section(children, tuple(children[1:]))

    predicates = init = _listed

    def functions(self, children: list[Any]) -> _Section:
        declared = (child for child in children[1:] if isinstance(child, PredicateDeclaration))
        return self._section(children, tuple(declared))

    def _names(self, children: list[Token]) -> _Section:
        return self._section(children, tuple(Term(str(t), self._place(t)) for t in children[1:]))

    functional = _names

    def _single(self, children: list[Any]) -> _Section:
        return self._section(children, children[1])

    precondition = effect = goal = of_domain = _single

    def parameters(self, children: list[Any]) -> _Section:
        return self._section(children, self._variables(children[1:]))

    def metric(self, children: list[Any]) -> _Section:
        if children[1] == "maximize":
            raise Misplaced(
                "PDDL_UNSUPPORTED",
                "metrics that maximize are not handled",
                self._place(children[1]),
            )
        wanted = children[2]
        name = wanted.predicate if isinstance(wanted, Atom) else str(wanted)
        if name != "total-cost":
            message = f"metric {name!r} is not handled, only total-cost"
            raise Misplaced("PDDL_UNSUPPORTED", message, self._place(children[1]))
        return self._section(children, name)

    def _section(self, children: Sequence[Any], content: Any) -> _Section:
        return _Section(str(children[0]).lstrip(":"), content, self._place(children[0]))

    # Wholes

    def action(self, children: list[Any]) -> ActionDeclaration:
        _, name, *sections = children
        place = self._place(name)
        given = _once(sections)
        nothing = And((), place)
        return ActionDeclaration(
            name=str(name),
            parameters=given.get("parameters", ()),
            precondition=given.get("precondition", nothing),
            effect=given.get("effect", nothing),
            place=place,
        )

    def derived(self, children: list[Any]) -> DerivedDeclaration:
        _, head, condition = children
        _refuse_repeated(head.parameters, "variable")
        return DerivedDeclaration(head.name, head.parameters, condition, head.place)

    def domain(self, children: list[Any]) -> DomainFragment:
        name, *items = children
        derived = tuple(item for item in items if isinstance(item, DerivedDeclaration))
        actions = tuple(item for item in items if isinstance(item, ActionDeclaration))
        sections = _once(item for item in items if isinstance(item, _Section))
        return DomainFragment(
            name=str(name), file=self.file, derived=derived, actions=actions, **sections
        )

    def problem(self, children: list[Any]) -> ProblemFragment:
        name, *items = children
        sections = _once(items)
        domain = str(sections.pop("domain", ""))
        return ProblemFragment(name=str(name), file=self.file, domain=domain, **sections)


def _once(sections: Iterable[_Section]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for section in sections:
        if section.kind in found:
            raise Misplaced("PDDL_TWICE", f"a second :{section.kind}", section.place)
        found[section.kind] = section.content
    return found


def _refuse_repeated(names: Sequence[TypedName], what: str) -> None:
    seen: set[str] = set()
    for name in names:
        if name.name in seen:
            raise Misplaced("PDDL_TWICE", f"{what} {name.name} stands here twice", name.place)
        seen.add(name.name)
