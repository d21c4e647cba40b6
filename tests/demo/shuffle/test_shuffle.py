"""Copies under random names can do, and are told, exactly what their originals can."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from demo.shuffle import Shuffled, shuffle
from demo.shuffle.package import Package
from demo.shuffle.vocabulary import Core, declared, spoken
from tests.planning.strangers import planner

from nondum.planning.ground.ground import ground
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.merge import merge
from nondum.planning.search.validate import validate
from nondum.planning.words.phrases import Phrasebook, phrasebook
from nondum.sdk.description import PluginDescription
from nondum.sdk.planner import GroundTask, Plan

PLUGINS = Path(__file__).parents[3] / "plugins"
LIBRARIES = ("espeak", "panorama")
PAYLOADS = (
    "recorded-camera",
    "thermal-camera",
    "people-detector",
    "pedestrian-detector",
    "visual-tracker",
    "mobile-base",
    "compton-camera",
    "pan-tilt-unit",
    "speaker",
)
FOLDERS = [PLUGINS / name for name in (*LIBRARIES, *PAYLOADS)]
HOST = "rover"
FOLLOW, POINT = "follow me through the facility", "point at the radiation source"
STAGES = {
    "following-colour": ("recorded-camera people-detector visual-tracker mobile-base", FOLLOW),
    "following-warmth": ("thermal-camera people-detector visual-tracker mobile-base", FOLLOW),
    "pointing": ("compton-camera pan-tilt-unit mobile-base", POINT),
    "everything": (" ".join(PAYLOADS), POINT),
}


@pytest.fixture(scope="session")
def originals() -> dict[str, PluginDescription]:
    """What each plugin says, by its folder's name."""
    return described({name: PLUGINS / name for name in PAYLOADS}, FOLDERS)


@pytest.fixture(scope="session")
def shuffled(tmp_path_factory: pytest.TempPathFactory) -> Shuffled:
    return shuffle(FOLDERS, tmp_path_factory.mktemp("shuffled"), seed=2024)


@pytest.fixture(scope="session")
def copies(shuffled: Shuffled) -> dict[str, PluginDescription]:
    """What each copy says, by the name of the folder that it was copied from."""
    folders = {name: shuffled.folders[name] for name in PAYLOADS}
    return described(folders, list(shuffled.folders.values()))


def described(folders: Mapping[str, Path], beside: list[Path]) -> dict[str, PluginDescription]:
    found = {}
    for name, folder in folders.items():
        [said] = Package.read(folder).described(beside)
        found[name] = PluginDescription.parse(said, where=name)
    return found


class World:
    """Some plugins on one host: what can be planned and said there."""

    def __init__(self, plugins: Mapping[str, PluginDescription]) -> None:
        """`plugins`: component id → description."""
        self.contributions = [
            Contribution.from_description(said, host=HOST, component=component)
            for component, said in plugins.items()
        ]
        self.merged = merge(self.contributions, HOST)
        assert not self.merged.quarantined

    @property
    def book(self) -> Phrasebook:
        return phrasebook(self.contributions, self.merged)

    def task(self, sentence: str) -> GroundTask:
        facts = {f"self {HOST}", *self.merged.init}
        facts.update(*(contribution.body_facts() for contribution in self.contributions))
        return ground(self.merged, facts, self.book.goal(sentence).expr)

    def plan(self, sentence: str) -> list[str]:
        task = self.task(sentence)
        answer = planner().plan(task, 5.0)
        assert isinstance(answer, Plan), answer
        assert not validate(task, answer)
        return [task.actions[step].name for step in answer.steps]


def world(stage: str, originals: Mapping[str, PluginDescription]) -> World:
    return World({name: originals[name] for name in STAGES[stage][0].split()})


def copied(stage: str, copies: Mapping[str, PluginDescription], shuffled: Shuffled) -> World:
    names = STAGES[stage][0].split()
    return World({shuffled.names.components[name]: copies[name] for name in names})


def renamed(text: str, shuffled: Shuffled) -> str:
    """A ground fact or action in the copies' names."""
    names = shuffled.names
    head, *arguments = text.split()
    plugin, dot, action = head.partition(".")
    new = f"{names.distributions[plugin]}.{names.actions[action]}" if dot else head
    return " ".join([new, *(_object(argument, shuffled) for argument in arguments)])


def _object(name: str, shuffled: Shuffled) -> str:
    host, *owned = name.split("__")
    if not owned:
        return shuffled.names.words.get(name, name)
    component, local = owned
    new = (host, shuffled.names.components[component], shuffled.names.words[local])
    return "__".join(new)


def facts_of(task: GroundTask) -> dict[str, Any]:
    """A task with its facts by name, in no order."""

    def named(indices: frozenset[int]) -> frozenset[str]:
        return frozenset(task.facts[index] for index in indices)

    return {
        "init": named(task.init),
        "goal": named(task.goal),
        **{a.name: (named(a.precondition), named(a.add), named(a.delete)) for a in task.actions},
    }


@pytest.mark.parametrize("stage", STAGES)
def test_tasks_are_equal_up_to_names(
    stage: str,
    originals: dict[str, PluginDescription],
    copies: dict[str, PluginDescription],
    shuffled: Shuffled,
) -> None:
    task = world(stage, originals).task(STAGES[stage][1])
    other = copied(stage, copies, shuffled).task(STAGES[stage][1])
    assert {renamed(fact, shuffled) for fact in task.facts} == set(other.facts)
    new, known = facts_of(other), facts_of(task)
    assert new.keys() == {
        name if name in ("init", "goal") else renamed(name, shuffled) for name in known
    }
    for key in ("init", "goal"):
        assert new[key] == {renamed(fact, shuffled) for fact in known[key]}
    for action in task.actions:
        assert new[renamed(action.name, shuffled)] == tuple(
            frozenset(renamed(fact, shuffled) for fact in facts) for facts in known[action.name]
        )


@pytest.mark.parametrize("stage", STAGES)
def test_plans_are_equal_up_to_names(
    stage: str,
    originals: dict[str, PluginDescription],
    copies: dict[str, PluginDescription],
    shuffled: Shuffled,
) -> None:
    sentence = STAGES[stage][1]
    plan = world(stage, originals).plan(sentence)
    assert copied(stage, copies, shuffled).plan(sentence) == [renamed(s, shuffled) for s in plan]


def test_people_say_the_same(
    originals: dict[str, PluginDescription],
    copies: dict[str, PluginDescription],
    shuffled: Shuffled,
) -> None:
    offers = world("everything", originals).book.offers()
    assert offers
    assert copied("everything", copies, shuffled).book.offers() == offers


def test_no_name_of_the_authors_is_left(
    originals: dict[str, PluginDescription],
    copies: dict[str, PluginDescription],
    shuffled: Shuffled,
) -> None:
    core = Core()

    def own(said: PluginDescription) -> set[str]:
        plain = said.to_dict()
        words = {t.text for part, t in spoken(plain) if not core.has(part, t.text)}
        return {plain["name"], *words, *declared(plain), *(f.name for f in said.fragments)}

    before = set[str]().union(*map(own, originals.values()))
    after = set[str]().union(*map(own, copies.values()))
    assert not before & after
    for folder in shuffled.folders.values():
        for path in folder.rglob("*"):
            assert path.name not in before
            if path.suffix == ".py":
                source = path.read_text(encoding="utf-8")
                assert not any(package in source for package in shuffled.names.packages)


def test_manifests_and_projects_name_only_each_other(shuffled: Shuffled) -> None:
    names = shuffled.names
    for name in PAYLOADS:
        package = Package.read(shuffled.folders[name])
        assert package.distribution == names.distributions[name]
        assert package.payload is not None
        assert package.payload["id"] == names.payloads[f"org.nondum.{name}"]
        [component] = package.payload["component"]
        assert component["id"] == names.components[name]
        assert component["distribution"] == package.distribution
        others = {r for r in package.requires if r in names.distributions}
        assert not others
    cameras = Package.read(shuffled.folders["recorded-camera"])
    assert names.distributions["nondum-panorama"] in cameras.requires


def test_order_and_names_come_from_the_seed(tmp_path: Path) -> None:
    folders = [PLUGINS / name for name in ("compton-camera", "pan-tilt-unit", "speaker")]
    found = [shuffle(folders, tmp_path / f"{i}", seed=seed) for i, seed in enumerate((1, 1, 2))]
    names = [[path.name for path in shuffled.payloads] for shuffled in found]
    assert names[0] == names[1]
    assert not set(names[0]) & set(names[2])

    def order(shuffled: Shuffled) -> list[int]:
        places = [shuffled.folders[folder.name] for folder in folders]
        return [places.index(path) for path in shuffled.payloads]

    assert order(found[0]) == order(found[1]) != order(found[2])
