"""Where a unit was is forgotten only after what used it has been asked to halt."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest
from tests.host.mind.robot import HOST, Robot
from tests.planning.strangers import (
    MOBILE_BASE,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    THERMAL_CAMERA,
    VISUAL_TRACKER,
)

from nondum.host.core.records.mount import MountPose
from nondum.sdk.description import PluginDescription

pytestmark = pytest.mark.anyio


def mount(plugin: PluginDescription) -> MountPose:
    """The place of a plugin's first unit."""
    unit = f"{HOST}__{plugin.name}__{plugin.units[0].name}"
    return MountPose(unit, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), "payload")


async def test_place_is_forgotten_after_its_users_were_asked_to_halt(robot: Robot) -> None:
    camera = mount(RECORDED_CAMERA)
    robot.mounts = (camera,)
    robot.plug(RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE)
    robot.mind.give(pddl="(following self person)", kind="maintain")
    await robot.until_holding()
    users = [robot.call("track"), robot.call("detect")]
    halted_when_forgotten: list[bool] = []

    def look(mounts: Mapping[str, Any]) -> None:
        if camera.unit not in mounts:
            halted_when_forgotten.extend(user.is_to_halt for user in users)

    robot.on_mounts = look
    robot.mounts = ()
    robot.unplug(RECORDED_CAMERA.name)
    await robot.until_goal("suspended")
    assert halted_when_forgotten == [True, True]
    assert robot.told_mounts[-1] == {}


async def test_new_place_is_told_at_once(robot: Robot) -> None:
    robot.mounts = (mount(THERMAL_CAMERA),)
    robot.plug(THERMAL_CAMERA)
    assert robot.told_mounts[-1].keys() == {mount(THERMAL_CAMERA).unit}
