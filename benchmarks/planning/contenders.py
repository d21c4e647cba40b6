"""The planners that are measured, in one process each: `python -m …planning.contenders NAME …`.

It prints one line of JSON: what it answers, and how long each phase took.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

_T = TypeVar("_T")

MEMORY_MB = 4096
REFUSED = "refused"
PLAN = "plan"
NO_PLAN = "no plan"
GAVE_UP = "gave up"


@dataclass
class Clock:
    """Seconds by phase, and what is left."""

    until_s: float
    phases: dict[str, float] = field(default_factory=dict)

    def take(self, phase: str, work: Callable[[], _T]) -> _T:
        """Do some work, and take its time."""
        began_s = time.monotonic()
        try:
            return work()
        finally:
            self.phases[phase] = time.monotonic() - began_s

    @property
    def left_s(self) -> float:
        """Until the limit."""
        return max(0.01, self.until_s - time.monotonic())


Answer = tuple[str, list[str]]
"""What it says, and the steps of a plan."""


def native(domain: Path, problem: Path, clock: Clock) -> Answer:
    """nondum's parser, grounder and search in one process."""
    from nondum.host.mind.native_planner import NativePlanner

    task = _ground(domain, problem, clock)
    return _said(task, clock.take("search", lambda: NativePlanner().plan(task, clock.left_s)))


def portfolio(domain: Path, problem: Path, clock: Clock) -> Answer:
    """The planners that nondum comes with, side by side in processes, as hosts run them."""
    from importlib_metadata import entry_points

    from nondum.host.mind.extension import GROUP
    from nondum.host.mind.planners import Planners

    found = {entry.name: entry.value for entry in entry_points(group=GROUP)}
    shipped = {name: found[name] for name in ("native", "pyperplan") if name in found}

    async def search(task: Any) -> Any:
        planners = Planners.of(shipped, memory_mb=MEMORY_MB)
        try:
            return (await planners.plan(task, clock.left_s)).answer
        finally:
            await planners.close()

    task = _ground(domain, problem, clock)
    return _said(task, clock.take("search", lambda: asyncio.run(search(task))))


def pyperplan(domain: Path, problem: Path, clock: Clock) -> Answer:
    """pyperplan as it comes: its own parser and grounder, greedy best-first search with hFF."""
    from pyperplan import grounding
    from pyperplan.pddl.parser import Parser
    from pyperplan.planner import HEURISTICS, SEARCHES

    def parse() -> Any:
        parser = Parser(str(domain), str(problem))
        return parser.parse_problem(parser.parse_domain())

    parsed = clock.take("parse", parse)
    task = clock.take("ground", lambda: grounding.ground(parsed))
    found = clock.take("search", lambda: SEARCHES["gbf"](task, HEURISTICS["hff"](task)))
    if found is None:
        return NO_PLAN, []
    return PLAN, [operator.name.strip("()") for operator in found]


def fast_downward(domain: Path, problem: Path, clock: Clock) -> Answer:
    """Fast Downward, LAMA's first iteration, on the files as they are."""
    from nondum.sdk.planner import AlreadyTrue, PddlTask, PlanText, Unsolvable
    from nondum_planner_fast_downward import FastDownwardPlanner

    task = PddlTask(domain.read_text(encoding="utf-8"), problem.read_text(encoding="utf-8"))
    match clock.take("all", lambda: FastDownwardPlanner().plan(task, clock.left_s)):
        case PlanText(steps):
            return PLAN, list(steps)
        case AlreadyTrue():
            return PLAN, []
        case Unsolvable():
            return NO_PLAN, []
        case gave_up:
            return (REFUSED if "ended with 3" in gave_up.why else GAVE_UP), []


CONTENDERS: dict[str, Callable[[Path, Path, Clock], Answer]] = {
    "native": native,
    "portfolio": portfolio,
    "pyperplan": pyperplan,
    "Fast Downward": fast_downward,
}


def installed() -> list[str]:
    """Those that can be measured here."""
    there = {"pyperplan": _has("pyperplan"), "Fast Downward": _has_engine()}
    return [name for name in CONTENDERS if there.get(name, True)]


def _has(package: str) -> bool:
    return find_spec(package) is not None


def _has_engine() -> bool:
    if not _has("nondum_planner_fast_downward"):
        return False
    from nondum_planner_fast_downward.engine import find_engine

    return find_engine() is not None


def _ground(domain: Path, problem: Path, clock: Clock) -> Any:
    from nondum.planning.ground.ground import ground
    from nondum.planning.pddl.parse import parse_formula
    from nondum_pddl_workbench.standalone import load

    clock.take("grammar", lambda: parse_formula("(and)", "nothing"))
    texts = (domain.read_text(encoding="utf-8"), problem.read_text(encoding="utf-8"))
    read = clock.take("parse", lambda: load(texts[0], str(domain), texts[1], str(problem)))
    return clock.take("ground", lambda: ground(read.merged, read.facts, read.goal))


def _said(task: Any, answer: Any) -> Answer:
    from nondum.sdk.planner import AlreadyTrue, Plan, Unsolvable

    match answer:
        case Plan(steps):
            return PLAN, [task.actions[step].name for step in steps]
        case AlreadyTrue():
            return PLAN, []
        case Unsolvable():
            return NO_PLAN, []
    return GAVE_UP, []


def main(name: str, domain: str, problem: str, limit_s: str) -> None:
    """Be one of them, once."""
    clock = Clock(time.monotonic() + float(limit_s))
    try:
        said, steps = CONTENDERS[name](Path(domain), Path(problem), clock)
        why = ""
    except Exception as error:  # a refusal, in whatever form it comes
        said, steps, why = REFUSED, [], f"{type(error).__name__}: {error}"[:200]
    print(json.dumps({"said": said, "steps": steps, "phases": clock.phases, "why": why}))


if __name__ == "__main__":
    main(*sys.argv[1:])
