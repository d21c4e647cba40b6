"""Plans as the planning competitions write them: an action a line, comments after `;`."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from nondum.planning.caret import refusal
from nondum.planning.syntax import Place
from nondum.sdk.errors import FragmentRefused

_TIMED = re.compile(r"\s*[0-9.]+\s*:\s*")
_DURATION = re.compile(r"\s*\[\s*[0-9.]+\s*\]\s*$")
_STEP = re.compile(r"\s*\(\s*([^\s();]+(?:\s+[^\s();]+)*)\s*\)\s*$")
_BREAK = re.compile(r"[ \t]+")

PSEUDO_STEPS = frozenset({"reach-goal", "__extra_goal_operator"})
"""What some planners write after the last action, and no domain knows."""


@dataclass(frozen=True, slots=True)
class Step:
    """One line of a plan."""

    name: str
    """`action obj …`, in lower case."""
    place: Place


def read_plan(text: str, file: str) -> tuple[Step, ...]:
    """The steps of a plan; times and durations that stand beside them are ignored.

    Raises `FragmentRefused` (E-SYNTAX) with every line that is no step.

    >>> [step.name for step in read_plan("; found\\n(GO A B)\\n0.001: (look) [1]\\n", "plan")]
    ['go a b', 'look']
    """
    steps: list[Step] = []
    problems = []
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.partition(";")[0]
        if not bare.strip():
            continue
        timed = _TIMED.match(bare)
        found = _STEP.match(_DURATION.sub("", bare[timed.end() if timed else 0 :]))
        place = Place(file, number, len(bare) - len(bare.lstrip()) + 1)
        if found:
            steps.append(Step(_BREAK.sub(" ", found[1].lower()), place))
        else:
            message = "expected a step, such as (move a b)"
            problems.append(refusal("E-SYNTAX", message, place, text))
    if problems:
        raise FragmentRefused(*problems)
    return tuple(steps)


def plan_lines(names: Iterable[str], cost: int, *, is_unit_cost: bool) -> str:
    """A plan as text.

    >>> print(plan_lines(["go a b", "look"], 2, is_unit_cost=True), end="")
    (go a b)
    (look)
    ; cost = 2 (unit cost)
    """
    steps = "".join(f"({name})\n" for name in names)
    return f"{steps}; cost = {cost} ({'unit' if is_unit_cost else 'general'} cost)\n"
