"""A merged domain, facts and a goal as PDDL text for planners that ground by themselves.

Only what they agree on is used: no `either`, one parent of a type, no variable that hides another.

Source: PDDL 2.2 (Edelkamp and Hoffmann 2004) with the action costs of the IPC 2008.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import prod

from nondum.planning.merge.domain import Action, DerivedRule, Merged, Predicate
from nondum.planning.merge.effect import ConditionalChange
from nondum.planning.merge.goal import GoalExpr
from nondum.planning.pddl.facts import fact, parts
from nondum.planning.pddl.syntax import Atom, Formula, Not, renamed_atom, terms_of
from nondum.planning.pddl.type_tree import TypeTree
from nondum.planning.pddl.typegraph import ROOT
from nondum.planning.pddl.wording import Spelling, Wording, all_of, apart, as_it_is, called
from nondum.sdk.planner import PddlTask

NAME = "nondum"
"""What the domain is called."""

_REQUIREMENTS = {
    ":negative-preconditions": r"\(not ",
    ":disjunctive-preconditions": r"\(or\b",
    ":equality": r"\(= [^(]",
    ":existential-preconditions": r"\(exists ",
    ":universal-preconditions": r"\(forall ",
    ":conditional-effects": r"\((when|forall) ",
    ":derived-predicates": r"\(:derived ",
    ":action-costs": r"\(:functions",
}
"""What some planners insist on being told, and what in the text calls for it."""


def pddl_text(
    merged: Merged,
    facts: Iterable[str],
    goal: GoalExpr,
    objects: Mapping[str, tuple[str, ...]] | None = None,
    *,
    spelled: Spelling = as_it_is,
) -> PddlTask:
    """Write a task down; the arguments are those of `ground`, and it is the same task.

    Types and actions are `spelled`. The same input gives the same text, whatever the order of
    `facts`.
    """
    types = {name: found.types for name, found in merged.objects.items()} | dict(objects or {})
    return _Writing(merged, frozenset(facts), goal, types, spelled).task()


@dataclass(slots=True)
class _Writing:
    merged: Merged
    facts: frozenset[str]
    goal: GoalExpr
    types: Mapping[str, tuple[str, ...]]
    """Object → its types."""
    spelled: Spelling
    words: Wording = field(init=False)
    actions: Mapping[str, str] = field(init=False)
    """Action → how it is spelled."""
    priced: dict[str, str] = field(default_factory=dict)
    """Function that has no value for some objects → the predicate that holds where it has one."""

    def __post_init__(self) -> None:
        domain = self.merged.domain
        tree = TypeTree(domain.types, self.types)
        names = {**self.spelled(name for name, _ in tree.edges()), ROOT: ROOT}
        self.words = Wording(tree, names, set(domain.predicates))
        self.actions = self.spelled(domain.actions)

    def task(self) -> PddlTask:
        goal = all_of(self.words.conjuncts(self.goal, frozenset()))
        body = self._body()
        needed = (name for name, sign in _REQUIREMENTS.items() if re.search(sign, body + goal))
        requirements = f"(:requirements {' '.join((':strips', ':typing', *needed))})"
        problem = (
            _section(":objects", self._typed(self.types.keys() - self._constants() | self._lost())),
            _section(":init", list(self._init())) or "(:init)",
            f"(:goal {goal})",
            *(["(:metric minimize (total-cost))"] if self._is_costed else []),
        )
        return PddlTask(
            f"(define (domain {NAME})\n{requirements}\n{body})\n",
            f"(define (problem {NAME})\n(:domain {NAME})\n{_lines(problem)})\n",
        )

    def _body(self) -> str:
        """The sections of the domain. Those that come first tell of what the others needed."""
        domain, names = self.merged.domain, self.words.types
        rules = [self._rule(rule) for rule in domain.derived]
        actions = [self._action(action) for action in domain.actions.values()]
        predicates = [self._declaration(p.name, p) for p in domain.predicates.values()]
        predicates += (f"({name} ?x - {ROOT})" for name in self.words.members.values())
        predicates += (self._declaration(n, domain.functions[f]) for f, n in self.priced.items())
        return _lines(
            (
                _section(
                    ":types", [f"{names[n]} - {names[p]}" for n, p in self.words.tree.edges()]
                ),
                _section(":constants", self._typed(self._constants())),
                _section(":predicates", predicates),
                _section(":functions", list(self._functions())),
                *rules,
                *actions,
            )
        )

    # Objects

    def _typed(self, names: Iterable[str]) -> list[str]:
        of = self.words.tree.objects
        return [f"{name} - {self.words.types[of.get(name, ROOT)]}" for name in sorted(names)]

    def _constants(self) -> frozenset[str]:
        """The objects that the domain names."""
        return _named(_formulas(self.merged))

    def _lost(self) -> frozenset[str]:
        """Objects that only the goal still speaks of."""
        return _named(self.goal.parts()) - self.types.keys() - self._constants()

    def _declaration(self, name: str, predicate: Predicate) -> str:
        types = enumerate(map(self.words.wide, predicate.parameters), 1)
        return f"({' '.join((name, *(f'?x{number} - {type_}' for number, type_ in types)))})"

    # Rules and actions

    def _rule(self, rule: DerivedRule) -> str:
        variables, besides = self.words.declared(rule.parameters)
        around = frozenset(parameter.name for parameter in rule.parameters)
        condition = all_of([*besides, *self.words.conjuncts(rule.condition, around)])
        return f"(:derived ({f'{rule.head.predicate} {variables}'.strip()})\n  {condition})"

    def _action(self, action: Action) -> str:
        variables, besides = self.words.declared(action.parameters)
        around = frozenset(parameter.name for parameter in action.parameters)
        needed = [*besides, *self.words.conjuncts(action.precondition, around)]
        needed += (guard for f in action.effect.cost_functions if (guard := self._guard(f)))
        changes = (self._change(change, around) for change in action.effect.conditional)
        effect = [*_changed(action.effect.add, action.effect.delete), *changes]
        effect += self._increases(action)
        return (
            f"(:action {self.actions[action.name]}\n  :parameters ({variables})\n"
            f"  :precondition {all_of(needed)}\n  :effect {all_of(effect)})"
        )

    def _change(self, change: ConditionalChange, around: frozenset[str]) -> str:
        names = apart(change.variables, around, (*change.atoms(), *change.condition.parts()))
        variables = called(change.variables, names)
        within = around | {variable.name for variable in variables}
        declared, besides = self.words.declared(variables)
        needed = [*besides, *self.words.conjuncts(change.condition.bound(names), within)]
        add, delete = (
            [renamed_atom(a, names) for a in some] for some in (change.add, change.delete)
        )
        effect = all_of(_changed(add, delete))
        if needed:
            effect = f"(when {all_of(needed)} {effect})"
        return f"(forall ({declared}) {effect})" if variables else effect

    # Costs

    @property
    def _is_costed(self) -> bool:
        effects = (action.effect for action in self.merged.domain.actions.values())
        return any(effect.cost != 1 or effect.cost_functions for effect in effects)

    def _increases(self, action: Action) -> Iterator[str]:
        if self._is_costed:
            yield from (f"(increase (total-cost) {f})" for f in action.effect.cost_functions)
            if action.effect.cost or not action.effect.cost_functions:
                yield f"(increase (total-cost) {action.effect.cost})"

    def _used(self) -> list[str]:
        """The functions that costs are added up from."""
        actions = self.merged.domain.actions.values()
        return sorted({f.predicate for action in actions for f in action.effect.cost_functions})

    def _functions(self) -> Iterator[str]:
        functions = self.merged.domain.functions
        if self._is_costed:
            yield "(total-cost) - number"
            yield from (f"{self._declaration(f, functions[f])} - number" for f in self._used())

    def _guard(self, function: Atom) -> str:
        """What keeps an action from being taken where its cost is not known; nothing where it
        always is. Not all planners think of that by themselves."""
        name = function.predicate
        wanted = self.merged.domain.functions[name].parameters
        is_one_of = self.merged.domain.types.is_one_of
        bindings = prod(sum(is_one_of(own, t) for own in self.types.values()) for t in wanted)
        if sum(row[0] == name for row, _ in self._values()) >= bindings:
            return ""
        if name not in self.priced:
            self.priced[name] = self.words.predicate(f"known-{name}")
        return str(Atom(self.priced[name], function.terms, function.place))

    def _values(self) -> Iterator[tuple[tuple[str, ...], int]]:
        """Function and objects, and what it gives for them."""
        for text, value in sorted(self.merged.values.items()):
            function, row = parts(text)
            if all(name in self.types for name in row):
                yield (function, *row), value

    # What is true at first

    def _init(self) -> Iterator[str]:
        domain = self.merged.domain
        known = domain.predicates.keys() - {rule.head.predicate for rule in domain.derived}
        for text in sorted(self.facts):
            predicate, row = parts(text)
            if predicate in known and all(name in self.types for name in row):
                yield f"({text})"
        for types, name in self.words.members.items():
            for thing, own in sorted(self.types.items()):
                if domain.types.is_one_of(own, types):
                    yield f"({fact(name, thing)})"
        if self._is_costed:
            yield "(= (total-cost) 0)"
            yield from self._prices()

    def _prices(self) -> Iterator[str]:
        used = self._used()
        for (function, *row), value in self._values():
            if function in used:
                yield f"(= ({fact(function, *row)}) {value})"
            if function in self.priced:
                yield f"({fact(self.priced[function], *row)})"


def _formulas(merged: Merged) -> Iterator[Formula]:
    """Everything in which the domain may name objects."""
    for action in merged.domain.actions.values():
        yield from action.precondition.parts()
        yield from (*action.effect.added(), *action.effect.deleted())
        yield from action.effect.cost_functions
        for change in action.effect.conditional:
            yield from change.condition.parts()
    for rule in merged.domain.derived:
        yield from rule.condition.parts()


def _named(formulas: Iterable[Formula]) -> frozenset[str]:
    terms = (term for formula in formulas for term in terms_of(formula))
    return frozenset(term.name for term in terms if not term.is_variable)


def _changed(add: Iterable[Atom], delete: Iterable[Atom]) -> list[str]:
    return [*map(str, add), *(str(Not(atom, atom.place)) for atom in delete)]


def _section(keyword: str, items: Sequence[str]) -> str:
    """A section with an item a line; nothing without items."""
    return f"({keyword}\n{_lines(f'  {item}' for item in items)})" if items else ""


def _lines(parts: Iterable[str]) -> str:
    return "\n".join(filter(None, parts))
