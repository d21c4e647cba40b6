"""Ten strangers' plugins plan together through the core's words alone."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from tests.planning.strangers import (
    MOBILE_BASE,
    PAN_TILT_UNIT,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    SPEAKER,
    STRANGERS,
    VISUAL_TRACKER,
    component,
    components,
    planner,
    task,
)

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.merge import merge
from nondum.planning.search.validate import validate
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import GoalRefused
from nondum.sdk.planner import GroundTask, Plan, Unsolvable

FOLLOW = "(following self person)"
POINT = "(pointing self radiation-source)"
REPORT = "(reported person self)"


def plan(contributions: Iterable[Contribution], goal: str) -> list[str]:
    """The names of the plan's steps; fails if there is none, or it is wrong."""
    grounded = task(contributions, goal)
    answer = planner().plan(grounded, 5.0)
    assert isinstance(answer, Plan), answer
    assert not validate(grounded, answer)
    return [grounded.actions[step].name for step in answer.steps]


def schemas(steps: Iterable[str]) -> list[str]:
    return [step.split()[0] for step in steps]


def has_no_plan(grounded: GroundTask) -> bool:
    return isinstance(planner().plan(grounded, 5.0), Unsolvable)


def test_person_is_followed() -> None:
    names = schemas(plan(components(STRANGERS), FOLLOW))
    assert names[0].endswith("camera.stream")
    assert names[1:] == ["people-detector.detect", "visual-tracker.track", "mobile-base.drive"]


def test_source_is_pointed_at() -> None:
    assert schemas(plan(components(STRANGERS), POINT)) == [
        "compton-camera.localise",
        "pan-tilt-unit.point",
    ]


def test_person_is_reported_by_watching() -> None:
    names = schemas(plan(components(STRANGERS), REPORT))
    assert names[1:] == ["people-detector.detect", "visual-tracker.watch", "speaker.report"]


def test_wires_are_in_the_plan() -> None:
    steps = plan(
        components([RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE]), FOLLOW
    )
    image = "rover__recorded-camera__frames"
    boxes = "rover__people-detector__found"
    twist = "rover__visual-tracker__steering"
    assert steps == [
        f"recorded-camera.stream rover__recorded-camera__camera {image} rover",
        f"people-detector.detect rover__people-detector__hog {image} {boxes} rover person",
        f"visual-tracker.track rover__visual-tracker__tracker {boxes} {twist} rover person",
        f"mobile-base.drive rover__mobile-base__wheels {twist} rover person",
    ]


def test_pulled_camera_leaves_no_plan() -> None:
    without = components([PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE])
    assert has_no_plan(task(without, FOLLOW))


def test_camera_on_another_body_is_no_help() -> None:
    elsewhere = component(RECORDED_CAMERA, host="mule")
    here = components([PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE])
    assert has_no_plan(task([*here, elsewhere], FOLLOW))


def test_detector_on_another_body_helps() -> None:
    elsewhere = component(PEOPLE_DETECTOR, host="mule")
    here = components([RECORDED_CAMERA, VISUAL_TRACKER, MOBILE_BASE])
    assert len(plan([*here, elsewhere], FOLLOW)) == 4


def test_one_output_slot_serves_one_robot() -> None:
    """Both want what the one detector finds in their own camera's images, at the same time."""
    shared = components([PEOPLE_DETECTOR])
    both = [
        component(plugin, host)
        for host in ("rover", "mule")
        for plugin in (RECORDED_CAMERA, VISUAL_TRACKER, MOBILE_BASE)
    ]
    goal = "(and (following rover person) (following mule person))"
    assert has_no_plan(task(shared + both, goal))
    second = component(PEOPLE_DETECTOR, host="mule")
    assert len(plan([*shared, *both, second], goal)) == 8


def test_plugin_never_plans_with_another_plugins_unit() -> None:
    grounded = task(components(STRANGERS), FOLLOW)
    for action in grounded.actions:
        assert f"__{action.schema.split('.')[0]}__" in action.arguments[0]


@pytest.mark.parametrize(
    ("missing", "goal"),
    [(PAN_TILT_UNIT, POINT), (SPEAKER, REPORT), (VISUAL_TRACKER, REPORT)],
    ids=lambda value: value if isinstance(value, str) else value.name,
)
def test_each_plugin_is_needed(missing: PluginDescription, goal: str) -> None:
    present = [plugin for plugin in STRANGERS if plugin is not missing]
    assert has_no_plan(task(components(present), goal))


def test_goal_about_an_unknown_object_is_refused() -> None:
    with pytest.raises(GoalRefused, match="'radiation-source'") as refused:
        task(components([PAN_TILT_UNIT]), POINT)
    assert refused.value.code == "PDDL_UNKNOWN"


def test_host_finds_what_a_call_needs() -> None:
    """Which component to call, with which arguments, streams and values."""
    present = components(STRANGERS)
    merged = merge(present, "rover")
    steps = {a.schema: a for goal in (FOLLOW, POINT) for a in task(present, goal).actions}
    track = steps["visual-tracker.track"]
    assert merged.owner(track.arguments[0]) == ("rover", "visual-tracker")
    assert merged.action(track.schema).behaviour == "track"
    assert merged.bound(track) == {
        "u": "rover__visual-tracker__tracker",
        "d": "rover__people-detector__found",
        "o": "rover__visual-tracker__steering",
        "h": "rover",
        "c": "person",
    }
    assert merged.streams(track) == (
        "rover__people-detector__found",
        "rover__visual-tracker__steering",
    )
    point = steps["pan-tilt-unit.point"]
    assert merged.streams(point) == ()
    assert merged.valued_facts(point) == ("bearing-known radiation-source rover",)
    assert merged.valued_facts(track) == ()
    assert "mobile-base.drive" in merged.lasting()
    assert "compton-camera.localise" not in merged.lasting()
