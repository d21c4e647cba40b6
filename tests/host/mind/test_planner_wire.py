"""What host and planner child say to each other arrives as it was meant."""

from __future__ import annotations

import pytest
from hypothesis import given
from tests.planning.search.random_tasks import tasks

from nondum.host.mind import planner_wire as wire
from nondum.sdk.errors import PlannerFailed
from nondum.sdk.planner import (
    AlreadyTrue,
    Answer,
    GaveUp,
    GroundTask,
    PddlTask,
    Plan,
    PlanText,
    Unsolvable,
)


@given(tasks())
def test_task_arrives_unchanged(task: GroundTask) -> None:
    body = wire.Request(task).body("ground")
    assert wire.task_from_wire(wire.unframed(body)) == task


def test_text_arrives_unchanged() -> None:
    text = PddlTask("(define (domain d))", "(define (problem p))")
    task = GroundTask((), frozenset(), frozenset(), ())
    body = wire.Request(task, lambda: text).body("pddl")
    assert wire.text_from_wire(wire.unframed(body)) == text


@pytest.mark.parametrize(
    "answer",
    [
        Plan((2, 0, 1), 7),
        PlanText(("move a b", "drop")),
        AlreadyTrue(),
        Unsolvable("exhausted"),
        Unsolvable("relaxed", ("at home",)),
        GaveUp("no time"),
    ],
    ids=lambda answer: type(answer).__name__,
)
def test_answer_arrives_unchanged(answer: Answer | PlanText) -> None:
    body = wire.frame(wire.answer_to_wire(answer))[wire.LENGTH.size :]
    assert wire.answer_from_wire(wire.unframed(body)) == answer


@pytest.mark.parametrize(
    "data",
    [
        None,
        [],
        ["plan"],
        ["plan", ["one"], 1],
        ["plan", [1], "dear"],
        ["plan text", [1]],
        ["maybe"],
    ],
    ids=str,
)
def test_what_is_no_answer_is_refused(data: object) -> None:
    with pytest.raises(PlannerFailed) as refused:
        wire.answer_from_wire(data)
    assert refused.value.code == "PLANNER_ANSWER"
