"""Plugins that try the shuffler: names that are the core's too, and names hidden from it."""

from __future__ import annotations

from pathlib import Path

import pytest
from demo.shuffle import NotEquivalent, shuffle, sources
from demo.shuffle.package import Package

SDK = Path(__file__).parents[3] / "plugins/sdk"

PROJECT = """\
[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"
[project]
name = "Sky_Watch"
version = "1.0"
readme = "README.md"
dependencies = ["nondum-sdk>=0.1", "sky-tables[fast]>=2"]
[project.entry-points."nondum.plugins"]
night = "sky_watch.plugin:Night"
[tool.hatch.build.targets.wheel]
packages = ["sky_watch"]
"""
LIBRARY = """\
[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"
[project]
name = "sky-tables"
version = "2.0"
[tool.hatch.build.targets.wheel]
packages = ["sky_tables"]
"""
PAYLOAD = """\
id = "org.sky.watch"
name = "Sky watch"
authors = ["Vega"]
[[component]]
id = "night"
distribution = "sky-watch"
[[component.device]]
name = "camera"
match = { SUBSYSTEM = "usb" }
[[component.unit]]
name = "camera"
xyz = [0.0, 0.0, 0.0]
rpy = [0.0, 0.0, 0.0]
"""
DOMAIN = """\
(define (domain night)
  (:types star - target)
  (:constants vega - star)
  (:predicates (above ?s - star ?h - host) (clear ?h - host))
  (:action find :parameters (?u - camera ?s - star ?h - host)
    :precondition (and (ready ?u) (above ?s ?h) (clear ?h)) :effect (found-star ?s ?h)))
"""
PROBLEM = """\
(define (problem tonight) (:domain night) (:init (above vega self)))
"""
PLUGIN = '''\
"""Night: finds stars."""
import nowhere_installed.optics as optics
from nowhere_installed import Lens
from nondum.sdk import (DeviceNeed, Fragment, Input, Label, Output, Phrase, Unit, behaviour,
                        condition, hookimpl)
from sky_tables.reading import slot

WIDE: list[Lens] = [optics.WIDE * 2]

class Night:
    """Finds stars."""

    @hookimpl
    def units(self):
        outputs, inputs = (Output("image", type="image"),), (Input(slot(), "pose"),)
        return (Unit(name="camera", type="camera", outputs=outputs, inputs=inputs),)

    @hookimpl
    def devices(self):
        return (DeviceNeed("camera", {"SUBSYSTEM": "usb", "camera": "yes"}),)

    @hookimpl
    def fragments(self):
        return tuple(Fragment.from_package("sky_watch", f) for f in ("night.pddl", "now.pddl"))

    @hookimpl
    def phrases(self):
        return (Phrase("show me {s:star}", "(found-star ?s "
                       "self)"),)

    @hookimpl
    def labels(self):
        return [Label("vega", words) for words in ("vega", "the brightest star")]

    @condition("weather", predicates=["clear"])
    async def weather(self, ctx):
        ctx.know("clear", ctx.host)

    @behaviour("find", action="(find ?u - camera ?s - star ?h - host)", phrase="find {s:star}")
    async def find(self, ctx, u, s, h):
        """Find vega, or so."""
        ctx.know("found-star", "vega", h)
'''
READING = '''\
def slot():
    """The camera's slot."""
    return "sky_watch" and "where"
'''


def night(folder: Path, *, plugin: str = PLUGIN, domain: str = DOMAIN) -> list[Path]:
    """A plugin with its own words, and a library that names its slot."""
    files = {
        "night/pyproject.toml": PROJECT,
        "night/payload.toml": PAYLOAD,
        "night/sky_watch/__init__.py": "",
        "night/sky_watch/plugin.py": plugin,
        "night/sky_watch/night.pddl": domain.replace(
            "(clear ?h - host)", "(clear ?h - host) (found-star ?s - star ?h - host)"
        ),
        "night/sky_watch/now.pddl": PROBLEM,
        "tables/pyproject.toml": LIBRARY,
        "tables/sky_tables/__init__.py": "",
        "tables/sky_tables/reading.py": READING,
    }
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    return [folder / "night", folder / "tables"]


@pytest.fixture
def folders(tmp_path: Path) -> list[Path]:
    return night(tmp_path)


def test_words_of_the_core_stay_where_the_core_means_them(
    folders: list[Path], tmp_path: Path
) -> None:
    made = shuffle(folders, tmp_path / "out", seed=1)
    [said] = Package.read(made.folders["night"]).described([*made.folders.values()])
    words = made.names.words
    [unit] = said["units"]
    assert (unit["name"], unit["type"]) == (words["camera"], "camera")
    assert [(s["name"], s["type"]) for s in unit["outputs"]] == [(words["image"], "image")]
    assert [(s["name"], s["type"]) for s in unit["inputs"]] == [(words["where"], "pose")]
    assert [d["name"] for d in said["devices"]] == [words["camera"]]


def test_own_types_predicates_and_objects_are_renamed_everywhere(
    folders: list[Path], tmp_path: Path
) -> None:
    made = shuffle(folders, tmp_path / "out", seed=1)
    [said] = Package.read(made.folders["night"]).described([*made.folders.values()])
    w, action = made.names.words, made.names.actions["find"]
    assert said["phrases"][0]["pattern"] == f"show me {{s:{w['star']}}}"
    assert said["phrases"][0]["goal"] == f"({w['found-star']} ?s self)"
    assert [(x["object"], x["words"]) for x in said["labels"]] == [
        (w["vega"], "vega"),
        (w["vega"], "the brightest star"),
    ]
    [behaviour] = said["behaviours"]
    assert behaviour["name"] == w["find"] != action
    assert behaviour["action"] == f"({action} ?u - camera ?s - {w['star']} ?h - host)"
    assert behaviour["phrases"] == [f"find {{s:{w['star']}}}"]
    assert behaviour["doc"] == "Find vega, or so."
    assert said["conditions"][0]["predicates"] == [w["clear"]]
    fragments = " ".join(fragment["text"] for fragment in said["fragments"])
    assert f"({w['above']} {w['vega']} self)" in fragments
    [source] = (made.folders["night"] / made.names.packages["sky_watch"]).glob("plugin.py")
    assert f"ctx.know({w['found-star']!r}, {w['vega']!r}, h)" in source.read_text(encoding="utf-8")


def test_requirements_on_each_other_follow(folders: list[Path], tmp_path: Path) -> None:
    made = shuffle(folders, tmp_path / "out", seed=1)
    project = Package.read(made.folders["night"]).project["project"]
    tables = made.names.distributions["sky-tables"]
    assert project["dependencies"] == ["nondum-sdk>=0.1", f"{tables}[fast]>=2"]
    assert project["entry-points"]["nondum.plugins"] == {
        made.names.components["night"]: f"{made.names.packages['sky_watch']}.plugin:Night"
    }
    assert made.libraries == (made.folders["tables"],)
    assert made.payloads == (made.folders["night"],)


def test_names_hidden_from_the_shuffler_are_told(tmp_path: Path) -> None:
    hidden = PLUGIN.replace('Unit(name="camera"', 'Unit(name="".join(["cam", "era"])')
    with pytest.raises(NotEquivalent, match="units are"):
        shuffle(night(tmp_path, plugin=hidden), tmp_path / "out", seed=1)


def test_our_own_packages_stay(folders: list[Path], tmp_path: Path) -> None:
    given = {"sdk": SDK, "stars": folders[0], "tables": folders[1]}
    found = sources(given, tmp_path / "out", seed=1)
    assert found["sdk"] == SDK
    assert found["stars"].parent == found["tables"].parent == tmp_path / "out"
    assert Package.read(found["tables"]).payload is None
