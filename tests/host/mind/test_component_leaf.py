"""Leaves of an integrator's system tree run behaviours of components."""

from __future__ import annotations

from dataclasses import replace

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence
from tests.host.mind.conftest import NATIVE, at_work
from tests.host.mind.robot import Robot
from tests.kit.clock import VirtualClock
from tests.planning.strangers import COMPTON_CAMERA, PAN_TILT_UNIT

from nondum.host.mind.planners import Planners
from nondum.host.mind.system_tree import Parts, default_tree
from nondum.planning.execute.running import LEASE_S

pytestmark = pytest.mark.anyio

POINT = "(pointing self radiation-source)"
LOCALISE, POINTING = "compton-camera.localise", "pan-tilt-unit.point"


class Wanted(Behaviour):
    """SUCCESS while a test wants what comes after it."""

    def __init__(self) -> None:
        super().__init__("wanted")
        self.is_so = False

    def update(self) -> Status:
        return Status.SUCCESS if self.is_so else Status.FAILURE


class Guarded:
    """The default tree with a leaf above the task, for as long as it is wanted."""

    def __init__(self, behaviour: str, of: str, **arguments: str) -> None:
        self.wanted = Wanted()
        self._asked = behaviour, of, arguments

    def tree(self, parts: Parts) -> Behaviour:
        behaviour, of, arguments = self._asked
        self.leaf = parts.behaviour(behaviour, of=of, **arguments)
        first = Sequence("first", memory=False, children=[self.wanted, self.leaf])
        guarded = Selector("guarded", memory=False, children=[first, parts.task])
        return default_tree(replace(parts, task=guarded))


def guarded_robot(guarded: Guarded) -> Robot:
    robot = Robot(Planners.of({"native": NATIVE}, memory_mb=512), system_tree=guarded.tree)
    robot.plug(COMPTON_CAMERA, PAN_TILT_UNIT)
    return robot


async def test_leaf_runs_a_behaviour_while_the_task_is_interrupted() -> None:
    guarded = Guarded("localise", "compton-camera")
    async with at_work(guarded_robot(guarded)) as robot:
        robot.mind.give(pddl=POINT, kind="maintain")
        await robot.until_holding()
        robot.stubborn.add("localise")
        guarded.wanted.is_so = True
        await robot.until(lambda: robot.running == {LOCALISE})
        row = robot.mind.views.tree()["children"][3]["children"][0]["children"][1]
        assert row["behaviour"] == {"component": "compton-camera", "behaviour": "localise"}
        assert row["status"] == "RUNNING"
        guarded.wanted.is_so = False
        await robot.until(lambda: robot.running == {POINTING})
        assert robot.call("localise").is_to_halt


async def test_leaf_succeeds_when_its_behaviour_has_finished() -> None:
    guarded = Guarded("localise", "compton-camera")
    async with at_work(guarded_robot(guarded)) as robot:
        guarded.wanted.is_so = True
        await robot.until(lambda: guarded.leaf.status is Status.SUCCESS)
        assert robot.started[0] == LOCALISE
        assert robot.call("localise").arguments["t"] == "radiation-source"


@pytest.mark.parametrize(
    ("behaviour", "of", "code"),
    [
        ("localise", "no-such", "BEHAVIOUR_UNKNOWN"),
        ("sing", "compton-camera", "BEHAVIOUR_UNKNOWN"),
        ("point", "pan-tilt-unit", "BEHAVIOUR_BLOCKED"),  # no bearing is known
    ],
)
async def test_leaf_that_cannot_run_fails_and_says_why(behaviour: str, of: str, code: str) -> None:
    guarded = Guarded(behaviour, of)
    async with at_work(guarded_robot(guarded)) as robot:
        guarded.wanted.is_so = True
        await robot.until(lambda: guarded.leaf.status is Status.FAILURE)
        assert code in guarded.leaf.feedback_message
        assert not robot.started


async def test_arguments_that_are_given_are_taken() -> None:
    guarded = Guarded("localise", "compton-camera", t="nothing-such")
    async with at_work(guarded_robot(guarded)) as robot:
        guarded.wanted.is_so = True
        await robot.until(lambda: guarded.leaf.status is Status.FAILURE)
        assert not robot.started


class Asleep(Behaviour):
    """Stands above the task, and keeps the tree from ticking it without interrupting it."""

    def __init__(self, task: Behaviour) -> None:
        super().__init__("asleep")
        self.is_asleep = False
        self._task = task

    def update(self) -> Status:
        if not self.is_asleep:
            self._task.tick_once()
        return Status.RUNNING


async def test_behaviours_of_a_task_that_is_no_longer_ticked_are_halted(
    clock: VirtualClock,
) -> None:
    above: list[Asleep] = []

    def tree(parts: Parts) -> Behaviour:
        above.append(Asleep(parts.task))
        return default_tree(replace(parts, task=above[0]))

    async with at_work(
        Robot(Planners.of({"native": NATIVE}, memory_mb=512), system_tree=tree)
    ) as robot:
        robot.plug(COMPTON_CAMERA, PAN_TILT_UNIT)
        robot.mind.give(pddl=POINT, kind="maintain")
        await clock.advance_until(robot.until_holding())
        above[0].is_asleep = True
        await clock.advance(LEASE_S + 1.0)
        await clock.advance_until(robot.until(lambda: not robot.running))
