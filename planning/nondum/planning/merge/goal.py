"""What a person wants, as a condition checked against the words known now."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Literal, TypeAlias

from nondum.planning.merge.domain import Merged, Origin
from nondum.planning.merge.scope import SELF, Report, Scope, TooManyProblems
from nondum.planning.pddl.caret import Misplaced
from nondum.planning.pddl.normal import Condition, condition_of
from nondum.planning.pddl.parse import parse_formula
from nondum.sdk.errors import FragmentRefused, GoalRefused, Problem
from nondum.sdk.frozen import frozen

GoalExpr: TypeAlias = Condition
"""Facts that must hold, must not hold, and objects that must be equal or not; no variables."""

GoalKind: TypeAlias = Literal["achieve", "do", "maintain"]
"""`achieve`: it is made true once. `do`: the same, again each time that it is asked for: what
behaviours that have ended once made true of it does not count. `maintain`: it is kept true."""

FILE = "goal"
"""Where problems with a goal's text are said to be."""


@frozen
class Goal:
    """A condition to make true, once or for as long as it is wanted."""

    expr: GoalExpr
    """`self` is replaced by the host's name."""
    kind: GoalKind
    text: str
    """As it was given: PDDL, or a person's words."""

    def __str__(self) -> str:
        return f"{self.kind} {goal_text(self.expr)}"


@lru_cache(maxsize=1024)
def read_goal(text: str) -> GoalExpr:
    """The condition that a text in PDDL says, whatever its words mean; each text is parsed once.

    Raises `GoalRefused`: PDDL_UNSUPPORTED, those of syntax.
    """
    try:
        return condition_of(parse_formula(text, FILE))
    except FragmentRefused as refused:
        raise GoalRefused(*refused.problems) from refused
    except Misplaced as wrong:
        raise GoalRefused(wrong.problem(text)) from wrong


def parse_goal(text: str, merged: Merged, *, kind: GoalKind = "achieve") -> Goal:
    """Read a goal written in PDDL: `(pointing self radiation-source)`.

    Raises `GoalRefused`: PDDL_UNKNOWN, PDDL_TYPE, PDDL_ARITY, PDDL_UNSUPPORTED, those of syntax.
    """
    condition = read_goal(text)
    problems = condition_problems(condition, text, merged)
    if problems:
        raise GoalRefused(*problems)
    return Goal(condition.bound({SELF: merged.self_host}), kind, text)


def goal_problems(goal: Goal, merged: Merged) -> tuple[Problem, ...]:
    """What keeps a goal in PDDL from being asked for now: names gone since it was given."""
    return condition_problems(goal.expr, goal.text, merged)


def goal_text(expr: GoalExpr) -> str:
    """The condition in PDDL."""
    parts = tuple(map(str, expr.parts()))
    return parts[0] if len(parts) == 1 else f"(and{''.join(f' {part}' for part in parts)})"


def condition_problems(
    condition: Condition,
    text: str,
    merged: Merged,
    variables: Mapping[str, tuple[str, ...]] | None = None,
) -> tuple[Problem, ...]:
    """What is wrong with a condition read from `text`: names, arities, types of terms.

    `variables` are the types of those it may contain.
    """
    report = Report(Origin("", "", ""), {FILE: text})
    scope = Scope(report, merged.self_host, {}, merged.domain.types)
    scope.predicates.update(merged.domain.predicates)
    scope.objects.update({name: found.types for name, found in merged.objects.items()})
    with suppress(TooManyProblems):
        for part in condition.parts():
            scope.check_formula(part, variables or {})
    return tuple(report.problems)
