"""From two files to an answer: reading, grounding and searching, shown on a terminal and timed."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from nondum.cli.failure import tell_problem
from nondum.cli.progress import ProgressLine
from nondum.sdk.errors import FragmentRefused
from nondum.sdk.frozen import frozen
from nondum_pddl_workbench.files import loaded

if TYPE_CHECKING:
    from nondum.host.mind.planners import Found, Planners
    from nondum.sdk.planner import Answer, GroundTask, PddlTask
    from nondum_pddl_workbench.standalone import Standalone

_T = TypeVar("_T")
_F = TypeVar("_F", bound=Callable[..., Any])

EXIT_ALREADY_TRUE = 10
EXIT_UNSOLVABLE = 11
EXIT_GAVE_UP = 12
INSTANCES_LIMIT = 1_000_000
"""Ground actions that a problem in a file may have; more than on a robot: only the caller waits."""
_TICK_S = 0.5


@frozen
class Limits:
    """The planner to ask (None: all), and the limits of the search."""

    planner: str | None
    timeout_s: float
    memory_mb: int


def search_options(command: _F) -> _F:
    """Add the options that `Limits` is made of."""
    for option in (
        click.option(
            "--memory",
            "memory_mb",
            metavar="MB",
            type=click.IntRange(min=64),
            default=4096,
            show_default=True,
            help="Memory of each planner.",
        ),
        click.option(
            "--timeout",
            "timeout_s",
            metavar="SECONDS",
            type=click.FloatRange(min=0, min_open=True),
            default=60.0,
            show_default=True,
            help="How long the search may take.",
        ),
        click.option("--planner", metavar="NAME", help="Ask only this planner [default: all]."),
    ):
        command = option(command)
    return command


@frozen
class Outcome:
    """What is known in the end."""

    answer: str
    """`plan`, `already true`, `unsolvable` or `gave up`."""
    exit: int
    steps: tuple[str, ...] = ()
    cost: int = 0
    proof: str = ""
    """Of what has no plan: `relaxed` or `exhausted`."""
    facts: tuple[str, ...] = ()
    """Of what has no plan: the facts that cannot be reached, where the proof names them."""
    reason: str = ""
    """Why nothing is known."""
    planner: str = ""
    """Who answered; empty where no search was needed."""


@dataclass(slots=True)
class Question:
    """A problem in files, and what was found out about it so far."""

    limits: Limits
    show: ProgressLine
    seconds: dict[str, float] = field(default_factory=dict)
    """Phase → how long it took."""

    def read(self, domain: Path, problem: Path) -> Standalone:
        """Read both, and tell warnings. Raises `FragmentRefused`."""
        found = self._timed("parse", lambda: loaded(domain, problem))
        for warning in found.warnings:
            tell_problem(warning, as_warning=True)
        return found

    def outcome(self, problem: Standalone) -> Outcome:
        """Ground and search. Raises `click.BadParameter` where the planner is not installed."""
        from nondum.planning.ground.ground import ground

        planners = _planners(self.limits)
        merged, facts, goal = problem.merged, problem.facts, problem.goal
        try:
            task = self._timed("ground", lambda: ground(merged, facts, goal, limit=INSTANCES_LIMIT))
        except FragmentRefused as too_many:
            return Outcome("gave up", EXIT_GAVE_UP, reason=too_many.problems[0].message)
        found = self._timed("search", lambda: asyncio.run(self._search(problem, task, planners)))
        return _outcome(found.answer, task, found.planner)

    async def _search(self, problem: Standalone, task: GroundTask, planners: Planners) -> Found:
        from nondum.planning.ground.pddl_text import pddl_text

        def text() -> PddlTask:
            return pddl_text(problem.merged, problem.facts, problem.goal)

        began_s, timeout_s = time.monotonic(), self.limits.timeout_s
        searching = asyncio.create_task(planners.plan(task, timeout_s, text))
        try:
            while not (await asyncio.wait({searching}, timeout=_TICK_S))[0]:
                took_s = time.monotonic() - began_s
                self.show(f"search, {took_s:.0f} s of {timeout_s:g} s", 0, 0)
            return searching.result()
        finally:
            searching.cancel()
            await asyncio.gather(searching, return_exceptions=True)
            await planners.close()

    def _timed(self, phase: str, work: Callable[[], _T]) -> _T:
        self.show(phase, 0, 0)
        began_s = time.monotonic()
        try:
            return work()
        finally:
            self.seconds[phase] = round(time.monotonic() - began_s, 4)


def _planners(limits: Limits) -> Planners:
    from importlib_metadata import entry_points

    from nondum.host.mind.extension import GROUP
    from nondum.host.mind.planners import Planners

    found = {entry.name: entry.value for entry in entry_points(group=GROUP)}
    if limits.planner is not None and limits.planner not in found:
        message = f"no planner {limits.planner!r} is installed, only {', '.join(sorted(found))}"
        raise click.BadParameter(message, param_hint="--planner")
    asked = sorted(found) if limits.planner is None else [limits.planner]
    return Planners.of({name: found[name] for name in asked}, memory_mb=limits.memory_mb)


def _outcome(answer: Answer, task: GroundTask, planner: str) -> Outcome:
    from nondum.planning.ground.literal_task import stands_for_goal
    from nondum.sdk.planner import AlreadyTrue, GaveUp, Plan, Unsolvable

    match answer:
        case Plan(steps, cost):
            names = tuple(task.actions[step].name for step in steps)
            return Outcome("plan", 0, names, cost, planner=planner)
        case AlreadyTrue():
            return Outcome("already true", EXIT_ALREADY_TRUE)
        case Unsolvable(proof, facts):
            named = tuple(fact for fact in facts if not stands_for_goal(fact))
            return Outcome("unsolvable", EXIT_UNSOLVABLE, proof=proof, facts=named, planner=planner)
        case GaveUp(why):
            return Outcome("gave up", EXIT_GAVE_UP, reason=why)
