"""One wrong value never ends a worker: it is told with component, type, field, file and line."""

from __future__ import annotations

import pytest
from tests.kit.golden import Golden
from tests.kit.workers import HOST, WorkersUnderTest

from nondum.host.core.events.facts import FactKnown
from nondum.host.core.events.workers import WorkerExited, WorkerFaulted
from nondum.host.workers.faults import MOST, Faults
from nondum.planning.execute.running import RunState
from nondum.sdk.description import Behaviour, Output, Unit
from nondum.sdk.errors import Problem

pytestmark = pytest.mark.anyio

PLUGIN = """
from nondum.sdk import Header, Output, Pose, Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("it", "sensor", outputs=(Output("fix", "pose"),)),)

@behaviour("do", action="(do ?u - sensor)")
async def do(ctx, u):
    %s

@behaviour("go-on", action="(go-on ?u - sensor)")
async def go_on(ctx, u):
    ctx.know("at", ctx.host, value=Pose(Header(), (1.0, 2.0, 3.0)))
"""
UNITS = (Unit("it", "sensor", outputs=(Output("fix", "pose"),)),)
BEHAVIOURS = (Behaviour("do", "(do ?u - sensor)"), Behaviour("go-on", "(go-on ?u - sensor)"))
WRONG = "Pose(Header(), (1.0, 2.0))"
BY_HAND = (
    "body = {'predicate': 'at', 'arguments': [ctx.host], 'value': %s}; "
    "ctx._workplace.tell('know', body, None)"
)
"""As an SDK of before, or a liar, would say it."""


async def faulted(tested: WorkersUnderTest, body: str) -> Problem:
    """Have a plugin make a mistake; what is told of it once."""
    await tested.start("gps", PLUGIN % body, units=UNITS, behaviours=BEHAVIOURS)
    pid = tested.workers.pids()["gps"]
    tested.behave("gps", "do", u=f"{HOST}__gps__it")
    event = await tested.until(WorkerFaulted)
    call = tested.behave("gps", "go-on", u=f"{HOST}__gps__it")
    assert await call.ended() is RunState.SUCCEEDED
    await tested.until(FactKnown)
    assert tested.workers.pids()["gps"] == pid
    assert tested.told(WorkerExited) == []
    (problem,) = event.problems
    assert event.component == "gps"
    assert problem in tested.workers.faults("gps")
    assert any(problem.code in line for line in tested.lines("gps"))
    return problem


@pytest.mark.parametrize(
    "body",
    [f"ctx.output('fix').send({WRONG})", f"ctx.know('at', ctx.host, value={WRONG})"],
    ids=["sent", "said"],
)
async def test_wrong_message_is_told_with_the_authors_line(
    tested: WorkersUnderTest, body: str, golden: Golden
) -> None:
    problem = await faulted(tested, body)
    assert problem.code == "MESSAGE_FIELD"
    assert problem.where == "gps (gps_plugin.py:10)"
    assert all(part in problem.message for part in ("pose.position", "3", "2"))


@pytest.mark.parametrize(
    ("value", "code", "situation"),
    [
        (
            "['pose', {'header': {}, 'position': [1.0, 2.0]}]",
            "MESSAGE_FIELD",
            "a value with a wrong field",
        ),
        ("['no such type', {}]", "MESSAGE_TYPE", "a value of no type"),
        ("3", "MESSAGE_FIELD", "a number for a value"),
    ],
)
async def test_wrong_value_that_the_host_finds_is_left_out(
    tested: WorkersUnderTest, value: str, code: str, situation: str, golden: Golden
) -> None:
    problem = await faulted(tested, BY_HAND % value)
    assert problem.code == code
    golden.check(situation, problem.message)
    known = tested.told(FactKnown)
    assert [event.value and event.value[0] for event in known] == ["pose"]


async def test_same_mistake_is_told_once_however_often_it_is_made(
    tested: WorkersUnderTest,
) -> None:
    by_hand = BY_HAND % "3"
    await faulted(tested, f"for _ in range(100): {by_hand}")
    assert len(tested.told(WorkerFaulted)) == 1


async def test_mistakes_go_with_the_worker(tested: WorkersUnderTest) -> None:
    await faulted(tested, BY_HAND % "3")
    await tested.workers.stop("gps")
    assert tested.workers.faults("gps") == ()


async def test_mistakes_without_end_are_not_all_kept() -> None:
    faults = Faults()
    told = [
        faults.take(WorkerFaulted("gps", (Problem("MESSAGE_FIELD", "x", where=f"a.py:{line}"),)))
        for line in range(3 * MOST)
    ]
    assert sum(told) == MOST
    assert [problem.where for problem in faults] == [f"a.py:{MOST - n}" for n in (3, 2, 1)]


def test_a_condition_that_ends_again_and_again_ends_at_one_place() -> None:
    faults = Faults()
    places = ("a.py:1", "a.py:2", "a.py:3")
    faults.take(WorkerFaulted("gps", tuple(Problem("MESSAGE_FIELD", "x", p) for p in places)))
    for place in places:
        faults.end("watch", place)
    assert [problem.where for problem in faults] == ["a.py:1", "a.py:2"]
