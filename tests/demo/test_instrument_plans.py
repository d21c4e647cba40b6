"""What both instruments say of themselves is enough to plan with, and neither names the other."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from nondum.planning.ground.ground import ground
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.merge import merge
from nondum.planning.words.phrases import phrasebook
from nondum.sdk.errors import GoalRefused
from nondum.sdk.planner import GroundTask
from nondum.sdk.plugin import describe, load
from nondum.wheelhouse.format.manifest import parse

PLUGINS = Path(__file__).parents[2] / "plugins"
NAMES = ("compton-camera", "pan-tilt-unit")
CAMERA, POINTER = "rover__rays__gamma-eye", "rover__arrow__laser-pointer"
HOST_FACTS = {
    "self rover",
    *(f"on {unit} rover" for unit in (CAMERA, POINTER)),
    *(f"{word} {unit}" for word in ("ready", "idle") for unit in (CAMERA, POINTER)),
}


def contribution(plugin: str, component: str) -> Contribution:
    loaded = load(f"nondum_{plugin.replace('-', '_')}.plugin", plugin)
    return Contribution.from_description(describe(loaded), host="rover", component=component)


def task(*contributions: Contribution, sentence: str) -> GroundTask:
    merged = merge(contributions, "rover")
    assert not merged.quarantined
    assert not merged.warnings
    goal = phrasebook(contributions, merged).goal(sentence)
    return ground(merged, HOST_FACTS | set(merged.init), goal.expr)


def steps(task: GroundTask) -> list[str]:
    """Apply whatever is applicable and new until the goal holds."""
    state, done = set(task.init), []
    while not task.goal <= state:
        action = next(a for a in task.actions if a.precondition <= state and not a.add <= state)
        state = state - action.delete | action.add
        done.append(action.name)
    return done


@pytest.mark.parametrize(
    "sentence", ["point at the radiation source", "please point the laser at radiation source"]
)
def test_a_sentence_of_two_strangers_words_has_a_plan(sentence: str) -> None:
    both = contribution("compton-camera", "rays"), contribution("pan-tilt-unit", "arrow")
    assert steps(task(*both, sentence=sentence)) == [
        f"compton-camera.localise {CAMERA} radiation-source rover",
        f"pan-tilt-unit.point {POINTER} radiation-source rover",
    ]


def test_the_camera_alone_can_locate() -> None:
    found = task(contribution("compton-camera", "rays"), sentence="locate the radiation source")
    assert steps(found) == [f"compton-camera.localise {CAMERA} radiation-source rover"]


def test_the_pointer_alone_knows_no_source() -> None:
    alone = contribution("pan-tilt-unit", "arrow")
    with pytest.raises(GoalRefused):
        task(alone, sentence="point at the radiation source")


@pytest.mark.parametrize("plugin", NAMES)
def test_manifests_are_well_formed(plugin: str) -> None:
    path = PLUGINS / plugin / "payload.toml"
    manifest = parse(path.read_text(encoding="utf-8"), str(path))
    assert manifest.id == f"org.nondum.{plugin}"


@pytest.mark.parametrize(("plugin", "other"), [NAMES, NAMES[::-1]])
def test_neither_names_the_other(plugin: str, other: str) -> None:
    told = re.compile(other.replace("-", "[-_ ]"), re.IGNORECASE)
    for path in (PLUGINS / plugin).rglob("*.*"):
        if path.suffix in {".py", ".pddl", ".toml", ".md"}:
            assert not told.search(path.read_text(encoding="utf-8")), path
