"""The journal keeps which behaviours one tick took down, and why each of them."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from tests.host.mind.robot import HOST, Robot
from tests.kit.golden import Golden
from tests.planning.strangers import (
    MOBILE_BASE,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    SPEAKER,
    VISUAL_TRACKER,
)

from nondum.host.core.events.behaviours import BehavioursHalted
from nondum.planning.execute.running import RunState

pytestmark = pytest.mark.anyio


async def follow(robot: Robot) -> None:
    robot.plug(RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE)
    robot.mind.give(pddl="(following self person)", kind="maintain")
    await robot.until_holding()


def told(robot: Robot) -> list[BehavioursHalted]:
    return [event for event in robot.events if isinstance(event, BehavioursHalted)]


def schemas(actions: Iterable[str]) -> set[str]:
    return {action.split(" ")[0] for action in actions}


async def test_pulled_camera_takes_all_down_in_one_tick(robot: Robot, golden: Golden) -> None:
    await follow(robot)
    assert not told(robot)
    robot.unplug("recorded-camera")
    await robot.until(lambda: not robot.running)
    (halts,) = told(robot)
    assert schemas(halts.lost) == {"recorded-camera.stream"}
    [why] = set(halts.lost.values())
    golden.check("the component is pulled", why)
    assert schemas(halts.halted) == {
        "people-detector.detect",
        "visual-tracker.track",
        "mobile-base.drive",
    }
    assert all(why.startswith("its guard is broken") for why in halts.halted.values())
    assert 0 < halts.tick <= robot.mind.ticks


async def test_behaviour_that_fails_is_told_with_what_needs_it(robot: Robot) -> None:
    await follow(robot)
    robot.call("track").end(RunState.FAILED, "no person is there")
    await robot.until(lambda: bool(told(robot)))
    first = told(robot)[0]
    assert dict(first.lost) == {next(iter(first.lost)): "no person is there"}
    assert schemas(first.lost) == {"visual-tracker.track"}
    assert schemas(first.halted) == {"mobile-base.drive"}


async def test_finished_work_is_not_told(robot: Robot) -> None:
    robot.plug(RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, SPEAKER)
    robot.mind.give(pddl=f"(reported person {HOST})")
    await robot.until_goal("reached")
    await robot.until(lambda: not robot.running)
    lasting = {"recorded-camera.stream", "people-detector.detect"}
    assert schemas([action for halts in told(robot) for action in halts.halted]) == lasting
    assert not any(halts.lost for halts in told(robot))


async def test_halting_by_a_person_is_told_once(robot: Robot, golden: Golden) -> None:
    await follow(robot)
    robot.mind.halt()
    await robot.until(lambda: not robot.running)
    await robot.until(lambda: bool(told(robot)))
    (halts,) = told(robot)
    [why] = set(halts.halted.values())
    golden.check("a person halts", why)
    assert len(halts.halted) == 4
