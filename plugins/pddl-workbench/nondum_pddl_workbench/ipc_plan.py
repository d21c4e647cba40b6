"""Plans as the planning competitions write them: an action a line, comments after `;`."""

from __future__ import annotations

import re
from collections.abc import Iterable

from nondum.planning.merge.scope import PROBLEMS_LIMIT
from nondum.planning.pddl.caret import refusal
from nondum.planning.pddl.syntax import Place
from nondum.sdk.errors import FragmentRefused
from nondum.sdk.frozen import frozen

_BESIDE = re.compile(r"^(\s*[0-9.]+(?:e[+-]?[0-9]+)?\s*:)|\[[^\][()]*\]", re.IGNORECASE)
"""The time before a step, and its duration and cost behind it: `[1.0]`, `[D:1.0; C:2.0]`."""
_STEP = re.compile(r"\(\s*([^\s();]+(?:\s+[^\s();]+)*)\s*\)")
_BREAK = re.compile(r"\s+")

PSEUDO_STEPS = frozenset({"reach-goal", "__extra_goal_operator"})
"""What some planners write after the last action, and no domain knows."""


@frozen
class Step:
    """One line of a plan."""

    name: str
    """`action obj …`, in lower case."""
    place: Place


def read_plan(text: str, file: str) -> tuple[Step, ...]:
    """The steps of a plan; times and durations that stand beside them are ignored.

    Raises `FragmentRefused` (PDDL_SYNTAX) with the lines that are no steps.

    >>> text = "; found\\n(GO A B)\\n0.001: (look) [1]\\n2: (LOOK) [D:1.0; C:0.5]\\n"
    >>> [step.name for step in read_plan(text, "plan")]
    ['go a b', 'look', 'look']
    """
    steps: list[Step] = []
    problems = []
    for number, line in enumerate(text.split("\n"), 1):
        bare = _BESIDE.sub("", line).partition(";")[0].strip()
        if not bare:
            continue
        place = Place(file, number, len(line) - len(line.lstrip()) + 1)
        if found := _STEP.fullmatch(bare):
            steps.append(Step(_BREAK.sub(" ", found[1].lower()), place))
        else:
            message = "expected a step, such as (move a b)"
            problems.append(refusal("PDDL_SYNTAX", message, place, text))
            if len(problems) == PROBLEMS_LIMIT:
                break
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
