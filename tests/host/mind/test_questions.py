"""Goals that are done again each time that they are given, and their answers."""

from __future__ import annotations

import pytest
from tests.host.mind.robot import HOST, Robot
from tests.planning.strangers import COMPTON_CAMERA

from nondum.host.core.events.goals import GoalReached
from nondum.planning.merge.goal import GoalKind

pytestmark = pytest.mark.anyio

LOCALISE = "(bearing-known radiation-source self)"
FACT = f"bearing-known radiation-source {HOST}"


async def asked(robot: Robot, kind: GoalKind) -> str:
    """Ask for the bearing, and wait until the goal is reached."""
    given = robot.mind.give(pddl=LOCALISE, kind=kind)
    await robot.until_goal("reached", given.id)
    return given.id


async def test_what_is_to_be_done_is_done_each_time(robot: Robot) -> None:
    robot.plug(COMPTON_CAMERA)
    for _ in range(3):
        await asked(robot, "do")
    assert robot.started == ["compton-camera.localise"] * 3


async def test_what_is_to_be_achieved_is_done_once(robot: Robot) -> None:
    robot.plug(COMPTON_CAMERA)
    for _ in range(3):
        await asked(robot, "achieve")
    assert robot.started == ["compton-camera.localise"]


async def test_what_was_achieved_before_is_done_for_who_asks_for_the_doing(robot: Robot) -> None:
    robot.plug(COMPTON_CAMERA)
    await asked(robot, "achieve")
    await asked(robot, "do")
    assert robot.started == ["compton-camera.localise"] * 2
    assert not robot.mind.beliefs.world.holds(FACT)


async def test_what_somebody_observes_needs_no_doing(robot: Robot) -> None:
    robot.plug(COMPTON_CAMERA)
    robot.know("compton-camera", "bearing-known", "radiation-source", HOST)
    await asked(robot, "do")
    assert robot.started == []
    assert robot.mind.beliefs.world.holds(FACT)


async def test_same_question_asked_twice_at_once_is_answered_twice(robot: Robot) -> None:
    robot.plug(COMPTON_CAMERA)
    for _ in range(2):
        robot.mind.give(pddl=LOCALISE, kind="do")
    await robot.until_goal("reached", "2")
    assert [e.goal for e in robot.events if isinstance(e, GoalReached)] == ["1", "2"]
    assert robot.started == ["compton-camera.localise"] * 2


async def test_answer_of_a_behaviour_is_told_and_kept_with_its_goal(robot: Robot) -> None:
    robot.plug(COMPTON_CAMERA)
    answer = "it is 40 degrees to the left"
    robot.answers["compton-camera.localise"] = answer
    given = robot.mind.give(pddl=LOCALISE, kind="do", said="where is the source")
    await robot.until_goal("reached", given.id)
    assert robot.mind.queue[given.id].reason == answer
    assert f"where is the source: {answer}" in robot.told
