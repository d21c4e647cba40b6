"""The example of a system tree: a robot that docks when its battery is low."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.host.mind.conftest import NATIVE, at_work
from tests.host.mind.robot import Robot
from tests.planning.strangers import COMPTON_CAMERA, PAN_TILT_UNIT

from nondum.host.mind.planners import Planners
from nondum.host.mind.system_tree import load_system_tree
from nondum.sdk.plugin import describe, load

pytestmark = pytest.mark.anyio

EXAMPLE = Path(__file__).parents[2] / "examples/dock_when_low"
POINT = "(pointing self radiation-source)"
DOCK, POINTING = "charger.dock", "pan-tilt-unit.point"


@pytest.fixture(autouse=True)
def importable(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """As an integrator's package on a host is."""
    monkeypatch.syspath_prepend(EXAMPLE)
    yield
    for name in [
        name for name in sys.modules if name.split(".")[0] in ("charger", "dock_when_low")
    ]:
        del sys.modules[name]


async def test_low_battery_interrupts_the_goal_until_the_robot_has_docked() -> None:
    robot = Robot(
        Planners.of({"native": NATIVE}, memory_mb=512),
        system_tree=load_system_tree("dock_when_low:tree"),
    )
    async with at_work(robot):
        robot.plug(
            COMPTON_CAMERA, PAN_TILT_UNIT, describe(load("charger.plugin:Charger", "charger"))
        )
        robot.mind.give(pddl=POINT, kind="maintain")
        await robot.until_holding()
        robot.stubborn.add("dock")
        robot.know("charger", "low-battery", "rover")
        await robot.until(lambda: robot.running == {DOCK})
        robot.forget("charger", "low-battery", "rover")
        await robot.until(lambda: robot.running == {POINTING})
        assert robot.mind.queue["1"].state.value == "active"


def test_charger_tells_a_low_battery_and_charges_it(worker: Any) -> None:
    bench = worker("charger.plugin:Charger", settings={"charge": 0.1})
    bench.wait_fact("low-battery", "robot")
    bench.behave("dock", u="dock", h="robot").assert_succeeded()
    bench.wait_until(lambda: ("low-battery", "robot") not in bench.facts, "that it is charged")
