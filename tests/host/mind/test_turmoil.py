"""Everything at once, at random: a mind comes through, and never does what is unsafe."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from random import Random

import pytest
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

from nondum.host.core.records.component import ComponentState
from nondum.planning.execute.running import RunState
from nondum.sdk.errors import GoalRefused

pytestmark = pytest.mark.anyio

PLUGINS = {
    plugin.name: plugin
    for plugin in (
        COMPTON_CAMERA,
        MOBILE_BASE,
        PAN_TILT_UNIT,
        PEOPLE_DETECTOR,
        RECORDED_CAMERA,
        SPEAKER,
        THERMAL_CAMERA,
        VISUAL_TRACKER,
    )
}
GOALS = ("(pointing self radiation-source)", "(reported person self)")


def replug(robot: Robot, random: Random) -> None:
    name = random.choice(sorted(PLUGINS))
    if name in robot.components:
        robot.unplug(name)
    else:
        robot.plug(PLUGINS[name])


def let_die(robot: Robot, random: Random) -> None:
    if robot.calls:
        random.choice(robot.calls).end(RunState.FAILED, "it died")


def disturb(robot: Robot, random: Random) -> None:
    if robot.components:
        name = random.choice(sorted(robot.components))
        robot.set_state(name, random.choice(list(ComponentState)))


def stall(robot: Robot, random: Random) -> None:
    robot.flow("recorded-camera", "frames", flowing=random.random() < 0.5)


def ask(robot: Robot, random: Random) -> None:
    with contextlib.suppress(GoalRefused):  # its words may be unplugged just now
        robot.mind.give(pddl=random.choice(GOALS), priority=random.choice([0, 1]))


TURMOIL: tuple[Callable[[Robot, Random], None], ...] = (replug, let_die, disturb, stall, ask)


@pytest.mark.parametrize("seed", range(6))
async def test_goal_is_held_again_after_turmoil(robot: Robot, seed: int) -> None:
    random = Random(seed)
    robot.plug(*PLUGINS.values())
    robot.mind.give(pddl="(following self person)", kind="maintain")
    for _ in range(60):
        random.choice(TURMOIL)(robot, random)
        for _ in range(random.randint(0, 30)):
            await asyncio.sleep(0)
            drivers = [c for c in robot.calls if c.behaviour == "drive" and not c.state.has_ended]
            assert len(drivers) <= 1
    robot.plug(*(plugin for name, plugin in PLUGINS.items() if name not in robot.components))
    for name in PLUGINS:
        robot.set_state(name, ComponentState.READY)
    robot.flow("recorded-camera", "frames", flowing=True)
    await robot.until_holding()
    assert not [text for text in robot.told if "fault" in text or "failed with" in text]
