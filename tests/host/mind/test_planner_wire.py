"""What host and planner child say to each other arrives as it was meant."""

from __future__ import annotations

import pytest
from hypothesis import given
from tests.planning.search.random_tasks import tasks

from nondum.host.mind import planner_wire as wire
from nondum.host.rpc.outcomes import packed, unpacked
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
    assert wire.task_of("ground", body) == task


def test_text_arrives_unchanged() -> None:
    text = PddlTask("(define (domain d))", "(define (problem p))")
    task = GroundTask((), frozenset(), frozenset(), ())
    body = wire.Request(task, lambda: text).body("pddl")
    assert wire.task_of("pddl", body) == text


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
    assert wire.answer_from_wire(unpacked(packed(wire.answer_to_wire(answer)))) == answer


@pytest.mark.parametrize(
    "data",
    [
        None,
        [],
        ["plan", [1], 1],
        [0],
        [0, ["one"], 1],
        [0, [1], "dear"],
        [4, [1]],
        [5],
    ],
    ids=str,
)
def test_what_is_no_answer_is_refused(data: object) -> None:
    with pytest.raises(PlannerFailed) as refused:
        wire.answer_from_wire(data)
    assert refused.value.code == "PLANNER_ANSWER"


def test_what_is_no_answer_is_not_sent() -> None:
    with pytest.raises(TypeError):
        wire.answer_to_wire("a plan")  # type: ignore[arg-type]  # that is the point
