"""Components are plugins of the host's pluggy manager, which planning and speech ask."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest
from tests.host.mind.robot import Robot
from tests.planning.strangers import COMPTON_CAMERA, PAN_TILT_UNIT, SPEAKER

from nondum.host.mind.component_plugins import Ask, ComponentPlugins
from nondum.host.mind.composition import compose
from nondum.host.mind.planners import Planners
from nondum.host.mind.translation import gathered
from nondum.planning.merge.contribution import Contribution
from nondum.sdk.errors import NondumError, Problem

pytestmark = pytest.mark.anyio

DESCRIBING = (
    *("describe", "fragments", "units", "devices", "behaviours", "conditions"),
    *("phrases", "labels"),
)


async def asked(component: str, hook: str, body: Mapping[str, Any]) -> Mapping[str, Any]:
    return {"of": component, "hook": hook, **body}


def robot() -> Robot:
    robot = Robot(Planners([]))
    robot.plug(COMPTON_CAMERA, PAN_TILT_UNIT)
    return robot


async def failing(component: str, hook: str, body: Mapping[str, Any]) -> Mapping[str, Any]:
    raise NondumError(Problem("PEER_GONE", f"{component} is not there"))


def plugins_of(robot: Robot, ask: Ask = asked) -> ComponentPlugins:
    assert robot.mind.composition is not None
    plugins = ComponentPlugins(ask)
    plugins.see(robot.mind.composition.snapshot)
    return plugins


@pytest.mark.parametrize("hook", DESCRIBING)
async def test_describing_hook_answers_for_each_component(hook: str) -> None:
    said = {one.component: one.value for one in getattr(plugins_of(robot()).hook, hook)()}
    assert said.keys() == {"compton-camera", "pan-tilt-unit"}
    if hook != "describe":
        assert said["pan-tilt-unit"] == getattr(PAN_TILT_UNIT, hook)


async def test_planning_knows_what_the_hooks_say() -> None:
    plugins = plugins_of(robot())
    pan_tilt = Contribution.from_description(
        PAN_TILT_UNIT, host="rover", component="pan-tilt-unit", rank=1
    )
    assert plugins.contributions()[1] == pan_tilt
    plugins.manager.unregister(name="pan-tilt-unit")
    assert [one.component for one in plugins.contributions()] == ["compton-camera"]


async def test_composition_is_made_of_what_the_manager_was_asked() -> None:
    one = robot()
    composition = one.mind.composition
    assert composition is not None
    assert composition.contributions == one.mind.plugins.contributions()
    assert compose(composition.snapshot).contributions == composition.contributions


async def test_component_goes_and_another_one_comes_by_its_name() -> None:
    one = robot()
    one.plug(SPEAKER)
    assert {said.component for said in one.mind.plugins.hook.units()} >= {"speaker"}
    one.unplug("speaker", "compton-camera")
    assert {said.component for said in one.mind.plugins.hook.units()} == {"pan-tilt-unit"}


@pytest.mark.parametrize(
    ("hook", "arguments"),
    [
        ("speak", {"text": "hi"}),
        ("listen", {}),
        ("learn_words", {"vocabulary": {}}),
        ("translate_goal", {"words": "hi", "vocabulary": {}}),
    ],
)
async def test_acting_hook_asks_each_component(hook: str, arguments: dict[str, Any]) -> None:
    said = getattr(plugins_of(robot()).hook, hook)(ctx=None, **arguments)
    answers = {one.component: await one.value for one in said}
    assert answers == {
        name: {"of": name, "hook": hook, **arguments}
        for name in ("compton-camera", "pan-tilt-unit")
    }


@pytest.mark.parametrize("hook", ["speak", "listen"])
async def test_component_that_fails_to_speak_or_listen_answers_nothing(hook: str) -> None:
    arguments = {"text": "hi"} if hook == "speak" else {}
    said = getattr(plugins_of(robot(), failing).hook, hook)(ctx=None, **arguments)
    assert [await one.value for one in said] == [None, None]


async def test_component_that_fails_to_translate_says_why() -> None:
    answers = plugins_of(robot(), failing).translations("hi", {})
    found, problems = await gathered(answers, 60)
    assert not found
    assert [(p.code, p.where) for p in problems] == [
        ("TRANSLATION_FAILED", "compton-camera"),
        ("TRANSLATION_FAILED", "pan-tilt-unit"),
    ]
