"""The shipped plugins plan together with nondum-core alone, and know nothing of each other."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import pytest
from tests.planning.strangers import ROVER, at_rest, components, planner, task

from nondum.host.workers.optional_inputs import choose, sockets_of, sources_of
from nondum.planning.ground.ground import ground
from nondum.planning.merge.domain import bind
from nondum.planning.merge.goal import goal_text
from nondum.planning.merge.merge import merge
from nondum.planning.words.phrases import phrasebook
from nondum.sdk.bench import WorkerFactory
from nondum.sdk.description import Output, PluginDescription, Unit
from nondum.sdk.planner import Plan, Unsolvable
from nondum.sdk.plugin import describe, load
from nondum.wheelhouse.format import manifest

PLUGINS = Path(__file__).parents[2] / "plugins"
FOLDERS = sorted(path.parent for path in PLUGINS.glob("*/payload.toml"))
SOURCES = (".py", ".pddl", ".toml")


def entry_point(folder: Path) -> str:
    project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (target,) = project["entry-points"]["nondum.plugins"].values()
    return str(target)


@pytest.fixture(scope="module")
def shipped() -> dict[str, PluginDescription]:
    libraries = (PLUGINS / name for name in ("espeak", "panorama", "phrase-choice"))
    sys.path += [str(folder) for folder in (*FOLDERS, *libraries)]
    return {folder.name: describe(load(entry_point(folder), folder.name)) for folder in FOLDERS}


@pytest.mark.usefixtures("shipped")
@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_each_is_what_the_bench_asks_for(folder: Path, worker: WorkerFactory) -> None:
    worker.check(folder)


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_no_plugin_names_another(folder: Path) -> None:
    others = {other.name for other in FOLDERS} - {folder.name}
    spelt = others | {other.replace("-", "_") for other in others}
    for path in folder.rglob("*"):
        if path.suffix in SOURCES and "tests" not in path.parts:
            text = path.read_text(encoding="utf-8")
            assert not [name for name in spelt if name in text], path


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_manifest_says_what_the_plugin_says(
    folder: Path, shipped: dict[str, PluginDescription]
) -> None:
    text = (folder / "payload.toml").read_text(encoding="utf-8")
    (component,) = manifest.parse(text, "payload.toml").components
    said = shipped[folder.name]
    assert component.distribution == folder.name
    assert component.devices == said.devices
    assert {unit.name for unit in component.units} <= {unit.name for unit in said.units}


@pytest.mark.parametrize(
    ("names", "words", "schemas"),
    [
        (
            ("recorded-camera", "people-detector", "visual-tracker", "mobile-base"),
            "follow me through the facility",
            ["stream", "detect", "track", "drive"],
        ),
        (
            ("thermal-camera", "people-detector", "visual-tracker", "mobile-base"),
            "follow people",
            ["stream", "detect", "track", "drive"],
        ),
        (
            ("recorded-camera", "people-detector", "visual-tracker", "speaker"),
            "report people",
            ["stream", "detect", "watch", "report"],
        ),
        (
            ("thermal-camera", "people-detector", "visual-tracker", "speaker"),
            "search for people",
            ["stream", "detect", "watch", "report"],
        ),
        (("gps", "compton-camera"), "locate the radiation source", ["localise"]),
    ],
    ids=["follow", "follow by warmth", "report", "search", "locate"],
)
def test_words_become_the_plan_that_is_meant(
    names: tuple[str, ...], words: str, schemas: list[str], shipped: dict[str, PluginDescription]
) -> None:
    contributions = components(shipped[name] for name in names)
    merged = merge(contributions, ROVER)
    assert not merged.quarantined
    goal = phrasebook(contributions, merged).goal(words)
    grounded = task(contributions, goal_text(goal.expr))
    answer = planner().plan(grounded, 60.0)
    assert isinstance(answer, Plan)
    steps = [grounded.actions[step].name.split()[0] for step in answer.steps]
    assert [step.partition(".")[2] for step in steps] == schemas


@pytest.mark.parametrize("words", ["look for people", "report people", "search for people"])
def test_who_asks_again_for_somebody_wants_another_look(
    words: str, shipped: dict[str, PluginDescription]
) -> None:
    names = ("recorded-camera", "people-detector", "visual-tracker", "speaker")
    contributions = components(shipped[name] for name in names)
    asked = phrasebook(contributions, merge(contributions, ROVER)).goal(words)
    assert asked.kind == "do"
    assert f"found person {ROVER}" in {bind(atom, {}) for atom in asked.expr.positive}


@pytest.mark.parametrize("words", ["where are you", "please tell me where you are"])
def test_where_it_is_can_be_told_while_that_is_known(
    words: str, shipped: dict[str, PluginDescription]
) -> None:
    contributions = components(shipped[name] for name in ("gps", "compton-camera"))
    merged = merge(contributions, ROVER)
    asked = phrasebook(contributions, merged).goal(words)
    assert asked.kind == "do"
    there = at_rest(contributions, merged)
    assert isinstance(planner().plan(ground(merged, there, asked.expr), 60.0), Unsolvable)
    grounded = ground(merged, there | {f"position-known {ROVER}"}, asked.expr)
    answer = planner().plan(grounded, 60.0)
    assert isinstance(answer, Plan)
    (step,) = answer.steps
    assert grounded.actions[step].name == f"gps.tell-position {ROVER}__gps__receiver {ROVER}"


GPS = PluginDescription(
    "a-gps", "1", units=(Unit("receiver", "sensor", outputs=(Output("fix", "pose"),)),)
)
"""A pose, but not of the base: what a stranger wrote, and was wired as the cameras' odometry."""


@pytest.mark.parametrize("reader", ["recorded-camera", "thermal-camera", "visual-tracker"])
@pytest.mark.parametrize("has_base", [False, True])
def test_position_of_a_gps_is_nobodys_odometry(
    reader: str, has_base: bool, shipped: dict[str, PluginDescription]
) -> None:
    there = {"a-gps": GPS, "gps": shipped["gps"]}
    there |= {"mobile-base": shipped["mobile-base"]} if has_base else {}
    flowing = [s for name, plugin in there.items() for s in sources_of("rover", name, plugin)]
    sockets = [s for s in sockets_of(reader, shipped[reader]) if s.slot == "odometry"]
    (choice,) = choose(sockets, flowing, {})
    assert (choice.source.component if choice.source else None) == (
        "mobile-base" if has_base else None
    )
    assert not choice.is_ambiguous


def test_every_optional_input_of_a_shipped_payload_says_of_what(
    shipped: dict[str, PluginDescription],
) -> None:
    sockets = [s for name, plugin in shipped.items() for s in sockets_of(name, plugin)]
    assert [socket.name for socket in sockets if not socket.of] == []
