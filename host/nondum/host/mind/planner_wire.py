"""Tasks and answers as plain data, for the link between the host and a planner child. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from threading import Lock
from typing import Any, TypeAlias, get_args

import msgpack

from nondum.sdk.errors import PlannerFailed, Problem, ProtocolViolation
from nondum.sdk.packet_codec import PacketCodec
from nondum.sdk.planner import (
    Answer,
    ConditionalEffect,
    GroundAction,
    GroundTask,
    Layer,
    PddlTask,
    PlanText,
    Rule,
)

MAX_BYTES = 256 * 1024 * 1024
"""No task that a child's memory limit admits is larger."""
DESCRIBE, PLAN = "describe", "plan"
"""What a child is asked: the language that it speaks and the features that it handles; a plan for a
task, until a time."""

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


def task_of(language: str, body: bytes) -> GroundTask | PddlTask:
    """The task in the body of a request; trusts it."""
    data = msgpack.unpackb(body)
    return PddlTask(*data) if language == "pddl" else task_from_wire(data)


_KINDS = (*get_args(Answer), PlanText)
_ANSWERS: PacketCodec[Answer | PlanText] = PacketCodec(_KINDS)


def answer_to_wire(answer: Answer | PlanText) -> Sequence[Any]:
    """A planner's answer as plain data. Raises `TypeError` for anything that is not one."""
    if type(answer) not in _KINDS:
        known = ", ".join(kind.__name__ for kind in _KINDS)
        raise TypeError(f"a planner answers with one of {known}, not with {answer!r}")
    return _ANSWERS.fields(answer)


def answer_from_wire(data: object) -> Answer | PlanText:
    """Check an answer and make the value of it. Raises `PlannerFailed` (PLANNER_ANSWER)."""
    try:
        return _ANSWERS.message(data)
    except ProtocolViolation as violation:
        text = f"not an answer: {violation.problems[0].message}"
        raise PlannerFailed(Problem("PLANNER_ANSWER", text)) from violation
