"""Goals that are pursued side by side, and those that wait for each other."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from tests.host.mind.robot import HOST, Robot
from tests.kit.golden import Golden
from tests.planning.strangers import (
    BEACON,
    COMPTON_CAMERA,
    LAMP,
    MOBILE_BASE,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    SPEAKER,
    VISUAL_TRACKER,
)

from nondum.host.core.events.behaviours import BehavioursHalted
from nondum.host.core.events.goals import PlanMade
from nondum.planning.execute.running import RunState

pytestmark = pytest.mark.anyio

FOLLOW = "(following self person)"
LOCALISE = "(bearing-known radiation-source self)"
REPORT = "(reported person self)"
LED = f"{HOST}__beacon__led"
RUDE = replace(
    BEACON,
    fragments=tuple(
        replace(one, text=re.sub(r"\(not \(idle \?u\)\) |\(idle \?u\)", "", one.text))
        for one in BEACON.fragments
    ),
    units=(replace(BEACON.units[0], users=1),),
)
"""It does not say in its actions that they need the unit for themselves."""
CHAIN = {
    "recorded-camera.stream",
    "people-detector.detect",
    "visual-tracker.track",
    "mobile-base.drive",
}


async def follow(robot: Robot) -> None:
    robot.plug(RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE)
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until_holding("1")


def halted(robot: Robot) -> set[str]:
    """The behaviours that were ever asked to halt."""
    return {f"{call.component}.{call.behaviour}" for call in robot.calls if call.is_to_halt}


def state(robot: Robot, id: str) -> tuple[str, str]:
    goal = robot.mind.queue[id]
    return goal.state.value, goal.reason


async def test_question_does_not_stop_a_robot_that_follows(robot: Robot) -> None:
    await follow(robot)
    robot.plug(COMPTON_CAMERA)
    robot.mind.give(pddl=LOCALISE)
    await robot.until_goal("reached", "2")
    assert not halted(robot)
    assert robot.holds("1")


async def test_plan_relies_on_what_another_goals_plan_keeps_so(robot: Robot) -> None:
    await follow(robot)
    robot.plug(SPEAKER)
    robot.mind.give(pddl=REPORT)
    await robot.until_goal("reached", "2")
    assert not halted(robot)
    (made,) = [e for e in robot.events if isinstance(e, PlanMade) and e.goal == "2"]
    assert [name.split(" ")[0] for name in made.steps] == [
        "visual-tracker.watch",
        "speaker.report",
    ]


async def test_plan_that_lost_its_support_to_another_goal_is_made_again(robot: Robot) -> None:
    await follow(robot)
    robot.plug(SPEAKER)
    robot.stubborn.add("watch")
    robot.mind.give(pddl=REPORT)
    await robot.until(lambda: "visual-tracker.watch" in robot.running)
    robot.mind.halt(id="1")
    robot.stubborn.clear()
    await robot.until_goal("reached", "2")
    assert robot.started.count("recorded-camera.stream") == 2
    await robot.until(lambda: not robot.running)


async def test_goals_to_maintain_are_kept_side_by_side(robot: Robot) -> None:
    await follow(robot)
    robot.plug(LAMP)
    robot.mind.give(pddl=f"(lit {HOST}__lamp__led)", kind="maintain")
    await robot.until_holding("2")
    assert robot.running == {*CHAIN, "lamp.shine"}
    assert robot.mind.queue["1"].state.value == "active"


async def test_less_urgent_goal_waits_for_what_a_more_urgent_one_uses(robot: Robot) -> None:
    robot.plug(BEACON)
    robot.mind.give(pddl=f"(lit {LED})", kind="maintain", priority=5)
    await robot.until_holding("1")
    robot.mind.give(pddl=REPORT, kind="maintain")
    await robot.until(lambda: state(robot, "2") == ("queued", f"waits for goal 1: both need {LED}"))
    assert robot.running == {"beacon.shine"}
    robot.mind.halt(id="1")
    await robot.until_holding("2")
    assert robot.running == {"beacon.flash"}


async def test_goal_is_suspended_when_its_plan_is_stuck_after_another_goal_made_way(
    robot: Robot,
) -> None:
    robot.plug(RUDE)
    robot.mind.give(pddl=f"(lit {LED})", kind="maintain")
    await robot.until_holding("1")
    robot.mind.give(pddl=f"(and (lit {LED}) (reported person self))", kind="maintain")
    await robot.until_goal("suspended", "2")
    assert [problem.code for problem in robot.mind.queue["2"].problems] == ["PLAN_STUCK"]


async def test_goal_that_cannot_be_had_at_all_says_so_though_another_goes_first(
    robot: Robot,
) -> None:
    robot.plug(BEACON, COMPTON_CAMERA)
    robot.mind.give(pddl=f"(lit {LED})", kind="maintain", priority=5)
    await robot.until_holding("1")
    robot.mind.give(pddl="(pointing self radiation-source)")
    await robot.until_goal("suspended", "2")
    assert state(robot, "1")[0] == "active"


async def test_waiting_goal_is_pursued_as_soon_as_another_unit_comes(robot: Robot) -> None:
    robot.plug(BEACON)
    robot.mind.give(pddl=f"(lit {LED})", kind="maintain", priority=5)
    await robot.until_holding("1")
    robot.mind.give(pddl=REPORT, kind="maintain")
    await robot.until(lambda: state(robot, "2")[0] == "queued" and bool(state(robot, "2")[1]))
    robot.plug(replace(BEACON, name="spare-beacon"))
    await robot.until_holding("2")
    assert robot.running == {"beacon.shine", "spare-beacon.flash"}


async def test_same_goal_given_twice_is_pursued_once(robot: Robot, golden: Golden) -> None:
    await follow(robot)
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until_holding("2")
    assert state(robot, "1")[0] == "halted"
    golden.check("the same goal was given again", state(robot, "1")[1])
    assert not halted(robot)
    robot.mind.halt(id="2")
    await robot.until(lambda: not robot.running)


async def test_halting_one_goal_leaves_the_rest_alone(robot: Robot) -> None:
    await follow(robot)
    robot.plug(LAMP)
    robot.mind.give(pddl=f"(lit {HOST}__lamp__led)", kind="maintain")
    await robot.until_holding("2")
    names = robot.mind.halt(id="2")
    assert [name.split(" ")[0] for name in names] == ["lamp.shine"]
    await robot.until(lambda: robot.running == CHAIN)
    assert halted(robot) == {"lamp.shine"}


async def test_failure_of_one_goals_behaviour_does_not_affect_other_goals(robot: Robot) -> None:
    await follow(robot)
    robot.plug(LAMP)
    robot.broken.add("lamp")
    robot.mind.give(pddl=f"(lit {HOST}__lamp__led)", kind="maintain")
    await robot.until_goal("suspended", "2")
    assert robot.running == CHAIN
    assert not halted(robot)


async def test_pulled_component_stops_only_the_goals_that_used_it(robot: Robot) -> None:
    await follow(robot)
    robot.plug(LAMP)
    robot.mind.give(pddl=f"(lit {HOST}__lamp__led)", kind="maintain")
    await robot.until_holding("2")
    robot.unplug("mobile-base")
    await robot.until_goal("suspended", "1")
    assert robot.running == {"lamp.shine"}
    robot.plug(MOBILE_BASE)
    await robot.until_holding("1")
    assert robot.running == {*CHAIN, "lamp.shine"}


async def test_plans_of_all_goals_are_shown(robot: Robot) -> None:
    await follow(robot)
    robot.plug(LAMP)
    robot.mind.give(pddl=f"(lit {HOST}__lamp__led)", kind="maintain")
    await robot.until_holding("2")
    plan = robot.mind.views.plan()
    shown = [(one["id"], len(one["steps"])) for one in (plan, *plan["beside"])]
    assert shown == [("2", 1), ("1", 4)]
    task = robot.mind.views.tree()["children"][3]
    assert [child["name"] for child in task["children"]] == ["goal 2", "goal 1", "hold"]


async def test_one_decision_tells_what_a_more_urgent_goal_took_down(robot: Robot) -> None:
    robot.plug(BEACON)
    robot.mind.give(pddl=f"(lit {LED})", kind="maintain")
    await robot.until_holding("1")
    robot.mind.give(pddl=REPORT, priority=5)
    await robot.until_goal("reached", "2")
    await robot.until_holding("1")
    took = [name for e in robot.events if isinstance(e, BehavioursHalted) for name in e.halted]
    assert took == [f"beacon.shine {LED}", f"beacon.flash {LED} person {HOST}"]
    assert robot.call("flash").state is RunState.HALTED
