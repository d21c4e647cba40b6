"""What host and planner child say to each other: length-prefixed msgpack over pipes."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import Any

import msgpack

from nondum.sdk.errors import PlannerFailed, Problem
from nondum.sdk.planner import (
    AlreadyTrue,
    Answer,
    GaveUp,
    GroundAction,
    GroundTask,
    Plan,
    Unsolvable,
)

LENGTH = struct.Struct(">I")
MAX_BYTES = 256 * 1024 * 1024
"""No task that a child's memory limit admits is larger."""


def frame(data: Any) -> bytes:
    """One message with its length in front."""
    body: bytes = msgpack.packb(data)
    return LENGTH.pack(len(body)) + body


def unframed(body: bytes) -> Any:
    """The message of a frame. Raises `PlannerFailed` (PLANNER_ANSWER)."""
    try:
        return msgpack.unpackb(body, strict_map_key=True)
    except (ValueError, msgpack.UnpackException) as error:
        raise _invalid(f"not msgpack ({error})") from error


def task_to_wire(task: GroundTask) -> list[Any]:
    """A ground task as plain data."""
    return [
        task.facts,
        sorted(task.init),
        sorted(task.goal),
        [
            [a.name, sorted(a.precondition), sorted(a.add), sorted(a.delete), a.cost]
            for a in task.actions
        ],
    ]


def task_from_wire(data: Any) -> GroundTask:
    """Make a ground task of what `task_to_wire` gave; trusts it."""
    facts, init, goal, actions = data
    return GroundTask(
        facts=tuple(facts),
        init=frozenset(init),
        goal=frozenset(goal),
        actions=tuple(_action(*action) for action in actions),
    )


def _action(
    name: str, precondition: Iterable[int], add: Iterable[int], delete: Iterable[int], cost: int
) -> GroundAction:
    return GroundAction(name, frozenset(precondition), frozenset(add), frozenset(delete), cost)


def answer_to_wire(answer: Answer) -> list[Any]:
    """A planner's answer as plain data. Raises `TypeError` for anything that is not one."""
    match answer:
        case Plan(steps, cost):
            return ["plan", list(steps), cost]
        case AlreadyTrue():
            return ["already true"]
        case Unsolvable(proof, facts):
            return ["unsolvable", proof, list(facts)]
        case GaveUp(why):
            return ["gave up", why]
    raise TypeError(f"a planner answers with Plan, AlreadyTrue, Unsolvable or GaveUp: {answer!r}")


def answer_from_wire(data: Any) -> Answer:
    """Check an answer and make the value of it. Raises `PlannerFailed` (PLANNER_ANSWER)."""
    match data:
        case ["plan", [*steps], int(cost)] if all(type(step) is int for step in steps):
            return Plan(tuple(steps), cost)
        case ["already true"]:
            return AlreadyTrue()
        case ["unsolvable", str(proof), [*facts]] if all(isinstance(f, str) for f in facts):
            return Unsolvable(proof, tuple(facts))
        case ["gave up", str(why)]:
            return GaveUp(why)
        case ["failed", str(why)]:
            raise PlannerFailed(Problem("PLANNER_RAISED", why))
    raise _invalid(f"not an answer: {str(data)[:100]}")


def _invalid(message: str) -> PlannerFailed:
    return PlannerFailed(Problem("PLANNER_ANSWER", message))
