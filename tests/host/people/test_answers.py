"""What a robot says of itself, of views as a real mind makes them and of ones made up."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.host.mind.robot import Robot
from tests.planning.strangers import COMPTON_CAMERA, PAN_TILT_UNIT

from nondum.host.core.records import ComponentState, DeviceClaim
from nondum.host.mind.lack import Need
from nondum.host.people.answering import Answering
from nondum.host.people.answers import LONGEST, abilities, activity, of_the_robot
from nondum.sdk.description import Label, PluginDescription

POINTING: PluginDescription = replace(
    PAN_TILT_UNIT,
    behaviours=tuple(replace(b, phrases=("point at {t}",)) for b in PAN_TILT_UNIT.behaviours),
)
SENSING = replace(COMPTON_CAMERA, labels=(Label("radiation-source", "the radiation source"),))
POINT = "point at the radiation source"


def can(words: str, now: str = "can", *needs: Need) -> dict[str, Any]:
    told = [need.to_dict() for need in needs]
    return {"words": words, "goal": f"({words})", "now": now, "needs": told}


def goal(
    text: str, state: str, reason: str = "", *needs: Need, holds: bool = False
) -> dict[str, Any]:
    told = [need.to_dict() for need in needs]
    return {"text": text, "state": state, "reason": reason, "needs": told, "holds": holds}


def nothing_of(*types: str, said: str = "in other words") -> Need:
    return Need("WHY_NO_OBJECT", said, types=types)


def step(component: str, state: str = "established") -> dict[str, Any]:
    return {"component": component, "state": state}


def answered(robot: Robot, coming: int = 0) -> str:
    return abilities(robot.mind.views.goals()()["can"], coming)


@pytest.mark.anyio
async def test_robot_says_what_it_can_do_and_what_it_lacks(robot: Robot) -> None:
    assert answered(robot) == "I can do nothing yet: nothing is plugged in that knows words."
    assert answered(robot, 2) == "I can do nothing yet: 2 payloads are being installed."
    robot.plug(POINTING)
    assert answered(robot) == "I can do nothing now: to point at something I need a target."
    robot.plug(SENSING)
    assert answered(robot) == f"I can {POINT}."
    assert answered(robot, 1) == f"I can {POINT}; a payload is being installed."
    robot.set_state("pan-tilt-unit", ComponentState.RESTARTING)
    await robot.until(lambda: POINT not in answered(robot) or "I need" in answered(robot))
    assert answered(robot) == f"I can do nothing now: to {POINT} I need the head to be ready."


@pytest.mark.anyio
async def test_component_that_waits_for_its_device_is_said_instead_of_what_it_lacks(
    robot: Robot,
) -> None:
    answering = Answering(robot.mind, lambda: (), lambda: ())
    waits = "pan-tilt-unit waits for its device head (then it can point)"
    robot.plug(POINTING)
    needs = (DeviceClaim("head", {"usb": "*:*"}, optional=False),)
    unit = replace(robot.components["pan-tilt-unit"], devices=needs)
    robot.components["pan-tilt-unit"] = unit
    robot.see()
    told = await answering.own("what can you do")
    assert told == f"I can do nothing now: {waits}; to point at something I need a target."
    robot.plug(SENSING)  # now it is the device alone
    assert await answering.own("what can you do") == f"I can do nothing now: {waits}."


@pytest.mark.anyio
async def test_robot_says_what_it_does(robot: Robot) -> None:
    def said() -> str:
        views = robot.mind.views
        return activity(views.given(), views.plan()["steps"])

    assert said() == "I do nothing: no one has asked for anything."
    robot.plug(SENSING, POINTING)
    robot.mind.give(words=POINT)
    assert said() == f"I was asked to {POINT}, and look for a way."
    await robot.until_holding()
    assert said() == f"I was asked to {POINT}, and I do, with pan-tilt-unit."
    robot.set_state("pan-tilt-unit", ComponentState.RESTARTING)
    await robot.until_goal("suspended")
    assert said() == f"I was asked to {POINT}, but for that I need the head to be ready."


def test_what_misses_the_same_is_said_once() -> None:
    need = nothing_of("image")
    rows = [can("look for me", "cannot", need), can("follow me", "cannot", need), can("sing")]
    assert abilities(rows) == "I can sing; to look for you and follow you I need an image."


def test_what_cannot_be_said_shortly_is_not_read_out() -> None:
    need = Need("WHY_CIRCLE", "whatever makes (dark c) true needs it first", "dark c")
    assert (
        abilities([can("sing"), can("dance", "cannot", need)]) == "I can sing; I cannot dance now."
    )
    told = abilities([can("look at {i}", "cannot", nothing_of("image", "depth"))])
    assert told == "I can do nothing now: to look at something I need an image or a depth."


def test_what_means_two_things_or_is_not_known_is_not_promised() -> None:
    rows = [can("sing", "ambiguous"), can("dance", "unknown"), can("greet <words>", "holds")]
    assert abilities(rows) == "I can greet."


def test_a_long_list_is_cut_to_what_can_be_spoken() -> None:
    rows = [can(f"carry the box number {number} to the other side") for number in range(30)]
    told = abilities(rows)
    assert len(told) <= LONGEST
    assert told.endswith(" and 27 things more.")


def test_lent_components_and_payloads_that_come_are_told_beside() -> None:
    assert activity([], [], {"eye"}) == "I do nothing of my own: eye runs for another host."
    assert activity([], [], (), 2) == "I do nothing: 2 payloads are being installed."
    goals = [goal("sing", "queued"), goal("dance", "active", holds=True)]
    assert activity(goals, [step("band@mule")], {"eye"}) == (
        "I was asked to dance, and I do, with band; eye runs for another host; "
        "1 more goal is waiting."
    )


def test_a_goal_that_is_worked_at_says_how_far_it_is() -> None:
    steps = [step("", "done"), step("base", "running")]
    told = activity([goal("look for me", "active")], steps)
    assert told == ("I was asked to look for you, and am at it, with base (1 of 2 steps done).")


def test_a_goal_in_pddl_is_not_turned_into_words() -> None:
    told = activity([goal("(lit rover)", "active", holds=True)], [])
    assert told == "I was asked for (lit rover), and I do."


def test_what_is_missing_is_told_by_data_whatever_the_sentences_say() -> None:
    said = "(ready rover__gun__it) does not hold: gun waits for its device it"
    image = nothing_of("image", said=said)
    assert (
        abilities([can("look", "cannot", image)])
        == "I can do nothing now: to look I need an image."
    )
    told = activity([goal("look", "suspended", said, image)], [])
    assert told == "I was asked to look, but for that I need an image."
    waits = Need("WHY_NOT_SO", "no power", "ready rover__gun__it", waits=True)
    waiting = ["gun has no power"]
    assert abilities([can("shoot", "cannot", waits)], 0, waiting) == (
        "I can do nothing now: gun has no power."
    )


@given(st.text(), st.text(), st.lists(st.text(), max_size=8))
def test_whatever_strangers_write_an_answer_can_be_spoken(
    words: str, reason: str, names: list[str]
) -> None:
    needs = (nothing_of(reason), Need("WHY_NOT_SO", reason, f"ready {reason}"))
    rows = [can(words, "cannot", *needs), can(words, "can"), *(can(name) for name in names)]
    steps = [step(name) for name in names]
    for state in ("active", "queued", "suspended"):
        for told in ((), needs[:1], needs[1:]):
            assert len(activity([goal(words, state, reason, *told)], steps, names)) <= LONGEST
    assert len(abilities(rows)) <= LONGEST


def test_who_speaks_is_somebody_else() -> None:
    assert of_the_robot("Tell me where my car is, and you yourself") == (
        "Tell you where your car is, and me myself"
    )
