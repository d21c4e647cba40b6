"""The system tree: the host's own, and an integrator's."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import replace

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector
from tests.host.mind.robot import Robot
from tests.kit.golden import Golden
from tests.planning.strangers import COMPTON_CAMERA, PAN_TILT_UNIT

from nondum.host.mind.planners import Planners
from nondum.host.mind.system_tree import Parts, default_tree, load_system_tree
from nondum.sdk.errors import ConfigRefused

pytestmark = pytest.mark.anyio

POINT = "(pointing self radiation-source)"


class Emergency(Behaviour):
    """An integrator's own leaf: RUNNING while somebody holds the red button."""

    is_pressed = False

    def update(self) -> Status:
        return Status.RUNNING if Emergency.is_pressed else Status.FAILURE


def cautious_tree(parts: Parts) -> Behaviour:
    """The default one with a guard above the task."""
    guarded = Selector("guarded", memory=False, children=[Emergency("red button"), parts.task])
    return default_tree(replace(parts, task=guarded))


class Faulty(Behaviour):
    """An integrator's mistake."""

    def update(self) -> Status:
        raise ZeroDivisionError("a mistake")


@pytest.fixture
def released() -> Iterator[None]:
    yield
    Emergency.is_pressed = False


async def test_parts_are_ticked_in_order(robot: Robot, golden: Golden) -> None:
    robot.plug(COMPTON_CAMERA)
    robot.mind.tick()
    view = robot.mind.views.tree()
    assert [child["name"] for child in view["children"]] == [
        "monitor",
        "world model",
        "goals",
        "task",
        "people",
    ]
    golden.check("there is no task", view["children"][3]["why"])


async def test_world_model_counts_in_words_that_fit(robot: Robot, golden: Golden) -> None:
    robot.plug()
    robot.mind.tick()
    counted = len(robot.mind.beliefs.world.facts)
    assert counted == 1
    golden.check("there is one fact", robot.mind.views.tree()["children"][1]["why"])


async def test_integrators_guard_interrupts_the_task(released: None) -> None:
    tree = load_system_tree(f"{__name__}:cautious_tree")
    robot = Robot(Planners.installed(memory_mb=512), system_tree=tree)
    running = asyncio.create_task(robot.mind.run())
    robot.plug(COMPTON_CAMERA, PAN_TILT_UNIT)
    robot.mind.give(pddl=POINT, kind="maintain")
    await robot.until_holding()
    Emergency.is_pressed = True
    await robot.until(lambda: not robot.running)
    Emergency.is_pressed = False
    await robot.until(lambda: robot.running == {"pan-tilt-unit.point"})
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    await robot.mind.close()


async def test_faulty_leaf_stops_the_robot_not_the_host(caplog: pytest.LogCaptureFixture) -> None:
    robot = Robot(Planners([]), system_tree=lambda parts: Faulty("faulty"))
    running = asyncio.create_task(robot.mind.run())
    await robot.until(lambda: any("a mistake" in text for text in robot.told))
    assert not running.done()
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    await robot.mind.close()


@pytest.mark.parametrize("path", ["nowhere:tree", "nondum.host.mind.mind:nothing", "mind", ""])
async def test_missing_system_tree_is_refused(path: str) -> None:
    with pytest.raises(ConfigRefused, match="CONFIG_SYSTEM_TREE"):
        load_system_tree(path)
