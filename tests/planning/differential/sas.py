"""What Fast Downward's translator makes of a task: its output, read and played.

Source of the format: https://www.fast-downward.org/latest/documentation/translator-output-format/
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from nondum.sdk.planner import PddlTask
from nondum_planner_fast_downward.engine import Engine

State: TypeAlias = tuple[int, ...]
"""The value of each variable."""


@dataclass(frozen=True)
class Effect:
    """What happens to one variable, where all conditions hold."""

    conditions: tuple[tuple[int, int], ...]
    variable: int
    value: int


@dataclass(frozen=True)
class Operator:
    """A ground action."""

    name: str
    precondition: tuple[tuple[int, int], ...]
    effects: tuple[Effect, ...]


@dataclass(frozen=True)
class Sas:
    """A task as Fast Downward searches it, axioms apart."""

    operators: tuple[Operator, ...]
    init: State
    goal: tuple[tuple[int, int], ...]
    has_axioms: bool

    def reaches_goal(self, steps: Iterable[str]) -> bool:
        """Whether a plan can be carried out and ends in the goal; there are no axioms."""
        states = {self.init}
        for step in steps:
            named = [operator for operator in self.operators if operator.name == step]
            assert named, f"{step} is no operator"
            states = {
                _after(state, operator)
                for state in states
                for operator in named
                if _holds(state, operator.precondition)
            }
        return any(_holds(state, self.goal) for state in states)


def translated(engine: Engine, task: PddlTask, folder: Path) -> Sas:
    """The task, with everything that the translator would leave out as unimportant."""
    (folder / "domain.pddl").write_text(task.domain, encoding="utf-8")
    (folder / "problem.pddl").write_text(task.problem, encoding="utf-8")
    keep = ("--keep-unimportant-variables", "--keep-no-ops", "--keep-unreachable-facts")
    subprocess.run(
        [*engine.translate, "domain.pddl", "problem.pddl", *keep],
        cwd=folder,
        env={**os.environ, **engine.environment},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    return _read(iter((folder / "output.sas").read_text(encoding="utf-8").splitlines()))


def _read(lines: Iterator[str]) -> Sas:
    init: State = ()
    goal: tuple[tuple[int, int], ...] = ()
    operators: list[Operator] = []
    has_axioms = False
    for line in lines:
        if line == "begin_state":
            init = tuple(int(value) for value in _until(lines, "end_state"))
        elif line == "begin_goal":
            goal = _pairs([next(lines) for _ in range(int(next(lines)))])
        elif line == "begin_operator":
            operators.append(_operator(lines))
        elif line == "begin_rule":
            has_axioms = True
    return Sas(tuple(operators), init, goal, has_axioms)


def _until(lines: Iterator[str], end: str) -> Iterator[str]:
    for line in lines:
        if line == end:
            return
        yield line


def _pairs(lines: Iterable[str]) -> tuple[tuple[int, int], ...]:
    found = (line.split() for line in lines)
    return tuple((int(variable), int(value)) for variable, value in found)


def _operator(lines: Iterator[str]) -> Operator:
    name = next(lines).strip()
    precondition = list(_pairs([next(lines) for _ in range(int(next(lines)))]))
    effects = []
    for _ in range(int(next(lines))):
        count, *rest = map(int, next(lines).split())
        *conditions, variable, before, after = rest
        if before != -1:
            precondition.append((variable, before))
        pairs = tuple(zip(conditions[::2], conditions[1::2], strict=True))
        assert len(pairs) == count
        effects.append(Effect(pairs, variable, after))
    return Operator(name, tuple(precondition), tuple(effects))


def _holds(state: State, condition: Iterable[tuple[int, int]]) -> bool:
    return all(state[variable] == value for variable, value in condition)


def _after(state: State, operator: Operator) -> State:
    values = list(state)
    for effect in operator.effects:
        if _holds(state, effect.conditions):
            values[effect.variable] = effect.value
    return tuple(values)
