"""Trees of a mind at work, as the daemon shows them."""

from __future__ import annotations

import asyncio
from typing import Any

from tests.host.mind.robot import Robot
from tests.planning.strangers import (
    COMPTON_CAMERA,
    MOBILE_BASE,
    PAN_TILT_UNIT,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    SPEAKER,
    THERMAL_CAMERA,
    VISUAL_TRACKER,
)

from nondum.host.mind.planners import Planners

CHAIN = (RECORDED_CAMERA, THERMAL_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE)


def at_rest() -> dict[str, Any]:
    """Nothing is asked for."""
    return asyncio.run(_shown(Robot(Planners([]))))


def following() -> dict[str, Any]:
    """On the way to following a person: camera and detector run, the tracker is starting."""
    robot = Robot(Planners.installed(memory_mb=512), stubborn={"track"})
    return asyncio.run(_pursuing(robot, "(following self person)", "maintain", "track"))


def reporting() -> dict[str, Any]:
    """A goal to achieve, with steps that have ended and steps that run side by side."""
    robot = Robot(Planners.installed(memory_mb=512), stubborn={"report", "localise"})
    goal = "(and (reported person self) (pointing self radiation-source))"
    return asyncio.run(_pursuing(robot, goal, "achieve", "report"))


async def _shown(robot: Robot) -> dict[str, Any]:
    robot.mind.tick()
    view = robot.mind.views.tree()
    await robot.mind.close()
    return view


async def _pursuing(robot: Robot, goal: str, kind: Any, until: str) -> dict[str, Any]:
    running = asyncio.create_task(robot.mind.run())
    robot.plug(*CHAIN, COMPTON_CAMERA, PAN_TILT_UNIT, SPEAKER)
    robot.mind.give(pddl=goal, kind=kind)
    await robot.until(lambda: any(name.endswith(f".{until}") for name in robot.running))
    view = robot.mind.views.tree()
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    await robot.mind.close()
    return view


def steps(view: dict[str, Any]) -> list[dict[str, Any]]:
    """The rows of a plan's steps, wherever they stand in a tree."""
    own = [view["step"]] if "step" in view else []
    return [*own, *(step for child in view["children"] for step in steps(child))]
