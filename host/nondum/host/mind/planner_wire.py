"""What host and planner child say to each other: length-prefixed msgpack over pipes."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from threading import Lock
from typing import Any, TypeAlias

import msgpack

from nondum.sdk.errors import PlannerFailed, Problem
from nondum.sdk.planner import (
    AlreadyTrue,
    Answer,
    ConditionalEffect,
    GaveUp,
    GroundAction,
    GroundTask,
    Layer,
    PddlTask,
    Plan,
    PlanText,
    Rule,
    Unsolvable,
)

LENGTH = struct.Struct(">I")
MAX_BYTES = 256 * 1024 * 1024
"""No task that a child's memory limit admits is larger."""

TaskText: TypeAlias = Callable[[], PddlTask]
"""Makes a task's PDDL text, once a planner wants it."""


class Request:
    """A task as planners are asked about it: made ready for the wire once for each language."""

    def __init__(self, task: GroundTask, text: TaskText | None = None) -> None:
        self.task = task
        self._text = text
        self._bodies: dict[str, bytes] = {}
        self._lock = Lock()

    def speaks(self, language: str) -> bool:
        """Whether the task can be told in a language."""
        return language == "ground" or self._text is not None

    def body(self, language: str) -> bytes:
        """The task in a language that it can be told in. May be called in any thread."""
        with self._lock:
            if language not in self._bodies:
                self._bodies[language] = msgpack.packb(self._plain(language))
            return self._bodies[language]

    def _plain(self, language: str) -> list[Any]:
        if language == "ground" or self._text is None:
            return task_to_wire(self.task)
        text = self._text()
        return [text.domain, text.problem]


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
        [_action_to_wire(action) for action in task.actions],
        [_layer_to_wire(layer) for layer in task.derived],
    ]


def _action_to_wire(action: GroundAction) -> list[Any]:
    """Most actions have no conditional effects, and are written without."""
    plain: list[Any] = [
        action.name,
        sorted(action.precondition),
        sorted(action.add),
        sorted(action.delete),
        action.cost,
    ]
    if action.conditional:
        plain.append(
            [[sorted(e.condition), sorted(e.add), sorted(e.delete)] for e in action.conditional]
        )
    return plain


def _layer_to_wire(layer: Layer) -> list[Any]:
    return [[[rule.head, sorted(rule.body)] for rule in layer.rules], layer.complements]


def task_from_wire(data: Any) -> GroundTask:
    """Make a ground task of what `task_to_wire` gave; trusts it."""
    facts, init, goal, actions, derived = data
    return GroundTask(
        facts=tuple(facts),
        init=frozenset(init),
        goal=frozenset(goal),
        actions=tuple(_action(*action) for action in actions),
        derived=tuple(_layer(*layer) for layer in derived),
    )


def _action(
    name: str,
    precondition: Iterable[int],
    add: Iterable[int],
    delete: Iterable[int],
    cost: int,
    conditional: Iterable[Iterable[Iterable[int]]] = (),
) -> GroundAction:
    return GroundAction(
        name,
        frozenset(precondition),
        frozenset(add),
        frozenset(delete),
        cost,
        tuple(ConditionalEffect(*map(frozenset, effect)) for effect in conditional),
    )


def _layer(
    rules: Iterable[tuple[int, Iterable[int]]], complements: Iterable[tuple[int, int]]
) -> Layer:
    return Layer(
        tuple(Rule(head, frozenset(body)) for head, body in rules),
        tuple((fact, other) for fact, other in complements),
    )


def text_from_wire(data: Any) -> PddlTask:
    """Make PDDL text of a request's body; trusts it."""
    return PddlTask(*data)


def answer_to_wire(answer: Answer | PlanText) -> list[Any]:
    """A planner's answer as plain data. Raises `TypeError` for anything that is not one."""
    match answer:
        case Plan(steps, cost):
            return ["plan", list(steps), cost]
        case PlanText(steps=names):
            return ["plan text", list(names)]
        case AlreadyTrue():
            return ["already true"]
        case Unsolvable(proof, facts):
            return ["unsolvable", proof, list(facts)]
        case GaveUp(why):
            return ["gave up", why]
    raise TypeError(
        f"a planner answers with Plan, PlanText, AlreadyTrue, Unsolvable or GaveUp: {answer!r}"
    )


def answer_from_wire(data: Any) -> Answer | PlanText:
    """Check an answer and make the value of it. Raises `PlannerFailed` (PLANNER_ANSWER)."""
    match data:
        case ["plan", [*steps], int(cost)] if all(type(step) is int for step in steps):
            return Plan(tuple(steps), cost)
        case ["plan text", [*names]] if all(isinstance(name, str) for name in names):
            return PlanText(tuple(names))
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
