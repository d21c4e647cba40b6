"""A goal that lacks a fact is told why nothing tells that fact, not that nothing makes it true."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tests.host.mind.robot import Robot
from tests.kit.golden import Golden

from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.device import DeviceClaim
from nondum.sdk.description import Behaviour, Condition, Fragment, PluginDescription, Unit
from nondum.sdk.errors import Problem

pytestmark = pytest.mark.anyio

DOMAIN = """(define (domain gps)
    (:predicates (position-known ?h - host) (place-told ?h - host))
    (:action report :parameters (?u - camera ?h - host)
                    :precondition (and (ready ?u) (position-known ?h))
                    :effect (place-told ?h)))"""
GPS = PluginDescription(
    "gps",
    "1.0",
    behaviours=(Behaviour("report", "(report ?u - camera ?h - host)"),),
    conditions=(Condition("position", ("position-known",)),),
    fragments=(Fragment("domain.pddl", DOMAIN),),
    units=(Unit("receiver", "camera"),),
)
DEAD = Problem("CONDITION_RAISED", "ValueError: no fix", where="position of gps (gps/plugin.py:95)")
GOAL = "(place-told self)"


async def reasons(robot: Robot) -> dict[str, str]:
    """Code → message of why the goal cannot be had."""
    robot.mind.give(pddl=GOAL)
    await robot.until_goal("suspended")
    return {problem.code: problem.message for problem in robot.mind.queue["1"].problems}


def change(robot: Robot, **fields: object) -> None:
    robot.components["gps"] = replace(robot.components["gps"], **fields)  # type: ignore[arg-type]  # of a record, as the tests below name them
    robot.see()


async def test_condition_that_has_ended_is_named_with_its_line(
    robot: Robot, golden: Golden
) -> None:
    robot.plug(GPS)
    change(robot, problems=(DEAD,))
    told = await reasons(robot)
    assert told.keys() == {"WHY_NOT_TOLD"}
    golden.check("a condition has ended", told["WHY_NOT_TOLD"])
    assert robot.mind.queue["1"].reason == told["WHY_NOT_TOLD"]


async def test_condition_that_ends_later_is_told_of_the_goal_that_waits(
    robot: Robot, golden: Golden
) -> None:
    robot.plug(GPS)
    told = await reasons(robot)
    golden.check("a condition has told nothing yet", told["WHY_NOT_TOLD"])
    change(robot, problems=(DEAD,))
    await robot.until(lambda: "gps/plugin.py:95" in robot.mind.queue["1"].reason)


async def test_device_that_is_not_there_is_named(robot: Robot, golden: Golden) -> None:
    robot.plug(GPS)
    change(robot, devices=(DeviceClaim("antenna", {"usb": "*:*"}, optional=False),))
    told = await reasons(robot)
    assert told.keys() == {"WHY_NOT_SO", "WHY_NOT_TOLD"}
    golden.check("a unit waits for its device", told["WHY_NOT_SO"])
    golden.check("a condition waits for its device", told["WHY_NOT_TOLD"])
    needs = robot.mind.queue["1"].needs
    assert [need.code for need in needs] == [*told]
    assert all(need.waits for need in needs)


async def test_worker_that_is_started_again_is_named_with_why_it_ended(robot: Robot) -> None:
    robot.plug(GPS)
    hung = Problem("WORKER_HUNG", "it showed no sign of life: held up in report, gps/plugin.py:7")
    change(robot, state=ComponentState.RESTARTING, problems=(hung,))
    told = await reasons(robot)
    assert all("gps/plugin.py:7" in message for message in told.values())


async def test_what_can_be_asked_for_and_advice_say_the_same(robot: Robot) -> None:
    robot.plug(replace(GPS, behaviours=(replace(GPS.behaviours[0], phrases=("where are you",)),)))
    change(robot, problems=(DEAD,))
    (row,) = robot.mind.views.goals()()["can"]
    assert "gps/plugin.py:95" in row["lacks"][0]
    assert "gps/plugin.py:95" in str(robot.mind.views.composition()["silence"])
