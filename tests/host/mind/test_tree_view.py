"""The tree as data: what people and tools are told of each step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from tests.cli import pictures
from tests.host.mind.robot import Robot
from tests.kit.golden import Golden
from tests.planning.strangers import (
    COMPTON_CAMERA,
    MOBILE_BASE,
    PAN_TILT_UNIT,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    THERMAL_CAMERA,
    VISUAL_TRACKER,
)

pytestmark = pytest.mark.anyio

FOLLOW = "(following self person)"


def task_row(robot: Robot) -> dict[str, Any]:
    """The row of the task tree."""
    slot = robot.mind.views.tree()["children"][3]
    return dict(slot["children"][0])


def step_rows(robot: Robot) -> list[dict[str, Any]]:
    return pictures.steps(robot.mind.views.tree())


async def test_nodes_say_what_kind_they_are(robot: Robot) -> None:
    tree = robot.mind.views.tree()
    assert (tree["kind"], tree["policy"]) == ("Parallel", "SuccessOnAll")
    kinds = [child["kind"] for child in tree["children"]]
    assert kinds == ["Duty", "Duty", "Duty", "TaskSlot", "Duty"]


async def test_task_says_what_it_is_for(robot: Robot) -> None:
    robot.plug(COMPTON_CAMERA, PAN_TILT_UNIT)
    robot.mind.give(pddl="(pointing self radiation-source)", kind="maintain")
    await robot.until_holding()
    task = task_row(robot)["task"]
    assert task == {
        "phase": "holding",
        "steps": 2,
        "left": 0,
        "excluded": [],
        "id": "1",
        "goal": "(pointing rover radiation-source)",
        "text": "(pointing self radiation-source)",
        "kind": "maintain",
        "cost": 2,
    }


async def test_steps_are_wired_by_what_they_give_each_other(robot: Robot) -> None:
    robot.stubborn = {"track"}
    robot.plug(*pictures.CHAIN)
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until(lambda: "visual-tracker.track" in robot.running)
    camera, detect, track, drive = step_rows(robot)
    assert [row["state"] for row in (camera, detect, track, drive)] == [
        "kept",
        "kept",
        "running",
        "waiting",
    ]
    assert {row["step"] for row in camera["needed_by"]} == {2}
    assert [row["step"] for row in drive["waits_for"]] == [3]
    assert drive["after"] == [3]
    assert drive["locks"]["unit"] == "rover__mobile-base__wheels"
    assert drive["started"] is None
    assert step_rows(robot)[2]["runs_s"] > track["runs_s"] > 0.0


async def test_alternative_is_named_with_cost_and_rank(robot: Robot) -> None:
    robot.plug(*pictures.CHAIN)
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until_holding()
    taken = step_rows(robot)[0]
    (other,) = taken["chosen"]["instead_of"]
    assert {taken["component"], other["component"]} == {"recorded-camera", "thermal-camera"}
    assert (taken["chosen"]["cost"], other["cost"]) == (1, 1)
    assert {taken["chosen"]["rank"], other["rank"]} == {0, 1}


async def test_plan_that_goes_on_is_not_thrown_over_for_a_cheaper_way(
    robot: Robot, golden: Golden
) -> None:
    (fragment,) = THERMAL_CAMERA.fragments
    text = fragment.text.replace("(flowing ?o)", "(increase (total-cost) 60) (flowing ?o)")
    dear = replace(THERMAL_CAMERA, fragments=(replace(fragment, text=text),))
    robot.plug(dear, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE)
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until_holding()
    robot.plug(RECORDED_CAMERA)
    robot.mind.tick()
    camera = step_rows(robot)[0]
    assert camera["component"] == "thermal-camera"
    golden.check("a cheaper one came while it ran", camera["chosen"]["why"])
    robot.mind.halt()
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until_holding("2")
    camera = step_rows(robot)[0]
    assert camera["component"] == "recorded-camera"
    golden.check("it is the cheapest", camera["chosen"]["why"])


async def test_what_failed_too_often_is_named_as_left_out(robot: Robot, golden: Golden) -> None:
    robot.broken = {"recorded-camera", "thermal-camera"}
    robot.plug(*pictures.CHAIN)
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until(lambda: bool(robot.mind.pursuit.exclusions.excluded))
    (first,) = robot.mind.pursuit.exclusions.excluded
    robot.broken = {first.split(".")[0]}
    await robot.until_holding()
    camera = step_rows(robot)[0]
    assert camera["component"] not in robot.broken
    assert camera["chosen"]["excluded"] == [first]
    golden.check("the other one failed", camera["chosen"]["why"])
    assert task_row(robot)["task"]["excluded"] == [first]
