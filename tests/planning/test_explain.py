"""A goal without a plan is traced to what is missing."""

from __future__ import annotations

from collections.abc import Iterable

from tests.planning.strangers import (
    LAMP,
    MOBILE_BASE,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    ROVER,
    SPEAKER,
    VISUAL_TRACKER,
    at_rest,
    component,
    components,
)

from nondum.planning.contribution import Contribution
from nondum.planning.explain import Diagnosis, explain, suppliers
from nondum.planning.goal import parse_goal
from nondum.planning.merge import merge
from nondum.planning.tracing import Lack

FOLLOW = "(following self person)"


def why(
    contributions: Iterable[Contribution], goal: str = FOLLOW, *, not_so: Iterable[str] = ()
) -> Diagnosis:
    present = list(contributions)
    merged = merge(present, ROVER)
    facts = at_rest(present, merged) - set(not_so)
    return explain(merged, facts, parse_goal(goal, merged).expr)


def test_pulled_camera_is_named_by_what_it_gave() -> None:
    diagnosis = why(components([PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE]))
    [cause] = diagnosis.causes
    assert (cause.lack, cause.types) == (Lack.OBJECT, ("image",))
    assert cause.path == ("mobile-base.drive", "visual-tracker.track", "people-detector.detect")
    assert str(diagnosis.problems()[0]) == (
        "WHY_NO_OBJECT there is no image, for"
        " mobile-base.drive ← visual-tracker.track ← people-detector.detect"
    )


def test_missing_action_is_named_by_its_effect() -> None:
    [cause] = why(components([PEOPLE_DETECTOR, RECORDED_CAMERA])).causes
    assert (cause.lack, cause.fact, cause.path) == (Lack.ACTION, "following rover person", ())


def test_camera_on_another_body_is_told() -> None:
    here = components([PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE])
    [cause] = why([*here, component(RECORDED_CAMERA, host="mule")]).causes
    assert cause.lack is Lack.HOST
    assert cause.fact == "on mule__recorded-camera__camera rover"


def test_unit_that_is_not_ready_is_told() -> None:
    present = components([RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE])
    unit = "rover__mobile-base__wheels"
    [cause] = why(present, not_so=[f"ready {unit}"]).causes
    assert (cause.lack, cause.fact) == (Lack.HOST, f"ready {unit}")
    assert "does not hold" in str(cause.problem())


def test_every_root_is_told() -> None:
    present = components([RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE])
    not_so = ["ready rover__mobile-base__wheels", "ready rover__recorded-camera__camera"]
    causes = why(present, not_so=not_so).causes
    assert sorted(cause.fact for cause in causes) == not_so


def test_contested_resource_is_told() -> None:
    shared = component(PEOPLE_DETECTOR)
    both = [
        component(plugin, host)
        for host in ("rover", "mule")
        for plugin in (RECORDED_CAMERA, VISUAL_TRACKER, MOBILE_BASE)
    ]
    goal = "(and (following rover person) (following mule person))"
    diagnosis = why([shared, *both], goal)
    assert not diagnosis.causes
    assert "free rover__people-detector__found" in diagnosis.contested
    assert "wanted twice" in diagnosis.problems()[0].message


def test_suppliers_are_those_that_bring_it() -> None:
    diagnosis = why(components([PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE]))
    known = components([SPEAKER, RECORDED_CAMERA, LAMP])
    assert [c.component for c in suppliers(diagnosis.causes, known)] == ["recorded-camera"]
    missing_base = why(components([PEOPLE_DETECTOR, RECORDED_CAMERA]))
    known = components([SPEAKER, MOBILE_BASE])
    assert [c.component for c in suppliers(missing_base.causes, known)] == ["mobile-base"]


def test_circle_of_needs_ends() -> None:
    """Detections may come from the detector's own output: tracing must not go round for ever."""
    present = components([SPEAKER, VISUAL_TRACKER, PEOPLE_DETECTOR])
    [cause] = why(present, "(reported person self)").causes
    assert cause.types == ("image",)
