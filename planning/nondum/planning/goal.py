"""What a person wants, as a condition checked against the words known now."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from nondum.planning.caret import Misplaced
from nondum.planning.domain import Merged, Origin
from nondum.planning.normal import Condition, condition_of
from nondum.planning.parse import parse_formula
from nondum.planning.scope import SELF, Report, Scope
from nondum.planning.syntax import Atom, Equal, Not, Term
from nondum.sdk.errors import FragmentRefused, GoalRefused, Problem

GoalExpr: TypeAlias = Condition
"""Facts that must hold, must not hold, and objects that must be equal or not; no variables."""

GoalKind: TypeAlias = Literal["achieve", "maintain"]

_FILE = "goal"


@dataclass(frozen=True, slots=True)
class Goal:
    """A condition to make true, once or for as long as it is wanted."""

    expr: GoalExpr
    """`self` is replaced by the host's name."""
    kind: GoalKind
    text: str
    """As it was given: PDDL, or a person's words."""

    def __str__(self) -> str:
        return f"{self.kind} {goal_text(self.expr)}"


def parse_goal(text: str, merged: Merged, *, kind: GoalKind = "achieve") -> Goal:
    """Read a goal written in PDDL: `(pointing self radiation-source)`.

    Raises `GoalRefused`: the codes of syntax, E-UNDECL, E-TYPE, E-PRED-ARITY, E-UNSUPPORTED.
    """
    try:
        condition = condition_of(parse_formula(text, _FILE))
    except FragmentRefused as refused:
        raise GoalRefused(*refused.problems) from refused
    except Misplaced as wrong:
        raise GoalRefused(wrong.problem(text)) from wrong
    problems = _problems(condition, text, merged)
    if problems:
        raise GoalRefused(*problems)
    return Goal(_bound(condition, merged.self_host), kind, text)


def goal_problems(goal: Goal, merged: Merged) -> tuple[Problem, ...]:
    """What keeps a goal from being asked for now: names that have gone since it was given."""
    return _problems(goal.expr, goal_text(goal.expr), merged)


def goal_text(expr: GoalExpr) -> str:
    """The condition in PDDL."""
    literals = (
        *expr.positive,
        *(Not(atom, atom.place) for atom in expr.negative),
        *expr.equal,
        *(Not(pair, pair.place) for pair in expr.unequal),
    )
    written = " ".join(map(str, literals))
    return written if len(literals) == 1 else f"(and {written})"


def _problems(condition: Condition, text: str, merged: Merged) -> tuple[Problem, ...]:
    report = Report(Origin("", "", ""), {_FILE: text})
    scope = Scope(report, merged.self_host, {}, merged.domain.types)
    scope.predicates.update(merged.domain.predicates)
    scope.objects.update({name: found.types for name, found in merged.objects.items()})
    for atom in condition.atoms():
        scope.check_atom(atom, {})
    for pair in condition.equal + condition.unequal:
        for term in (pair.left, pair.right):
            scope.check_term(term, ("object",), {})
    return tuple(report.problems)


def _bound(condition: Condition, host: str) -> Condition:
    def term(found: Term) -> Term:
        return Term(host, found.place) if found.name == SELF else found

    def atoms(found: tuple[Atom, ...]) -> tuple[Atom, ...]:
        return tuple(Atom(a.predicate, tuple(map(term, a.terms)), a.place) for a in found)

    def pairs(found: tuple[Equal, ...]) -> tuple[Equal, ...]:
        return tuple(Equal(term(p.left), term(p.right), p.place) for p in found)

    return Condition(
        atoms(condition.positive),
        atoms(condition.negative),
        pairs(condition.equal),
        pairs(condition.unequal),
    )
