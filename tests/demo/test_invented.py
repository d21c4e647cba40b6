"""Plugins whose every name was made up just now work together on the bench and in a plan."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from demo.shuffle.words import Words
from tests.demo.invented import Invented, listener, sentence, talker
from tests.planning.strangers import planner

from nondum.planning.ground.ground import ground
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.goal import parse_goal
from nondum.planning.merge.merge import merge
from nondum.planning.words.phrases import phrasebook
from nondum.sdk import Header, Text
from nondum.sdk.bench import WorkerFactory
from nondum.sdk.planner import Plan, Unsolvable
from nondum.sdk.plugin import describe, load
from nondum.wheelhouse.build.build import Options, build
from nondum.wheelhouse.build.verification import verify
from nondum.wheelhouse.format.signatures import UnsignedAllowed
from nondum.wheelhouse.format.target import Target

ROOT = Path(__file__).parents[2]
HOST = "rover"
ROOMS = ("host", "planning", "transport", "wheelhouse", "plugins/sdk")


@pytest.fixture
def strangers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Invented]]:
    """Two talkers and two listeners, importable."""
    words = Words(7)
    made = [write(tmp_path, words) for write in (talker, talker, listener, listener)]
    for stranger in made:
        monkeypatch.syspath_prepend(stranger.folder)
    yield made
    roots = {stranger.entry_point.split(".")[0] for stranger in made}
    for name in [name for name in sys.modules if name.split(".")[0] in roots]:
        del sys.modules[name]  # the next test has strangers of these names in another folder


def contribution(invented: Invented) -> Contribution:
    said = describe(load(invented.entry_point, invented["distribution"]))
    return Contribution.from_description(said, host=HOST, component=invented["component"])


def plan(strangers: list[Invented], goal: str, *, is_words: bool = False) -> list[str] | None:
    """The steps that reach a goal; None when it is proven that there are none."""
    contributions = [contribution(stranger) for stranger in strangers]
    merged = merge(contributions, HOST)
    assert not merged.quarantined
    facts = {f"self {HOST}", *merged.init}
    facts.update(*(c.body_facts() for c in contributions))
    asked = phrasebook(contributions, merged).goal(goal) if is_words else parse_goal(goal, merged)
    task = ground(merged, facts, asked.expr)
    answer = planner().plan(task, 5.0)
    if isinstance(answer, Unsolvable):
        return None
    assert isinstance(answer, Plan)
    return [task.actions[step].name for step in answer.steps]


def test_no_name_occurs_in_nondum(strangers: list[Invented]) -> None:
    sources = [
        path
        for room in ROOMS
        for path in (ROOT / room).rglob("*")
        if path.suffix in {".py", ".pddl", ".lark", ".sql", ".toml", ".md"}
    ]
    assert len(sources) > 100
    text = "\n".join(path.read_text(encoding="utf-8") for path in sources).lower()
    assert not [n for stranger in strangers for n in stranger.names.values() if n in text]


def test_strangers_share_no_name(strangers: list[Invented]) -> None:
    names = [name for stranger in strangers for name in stranger.names.values()]
    assert len(names) == len(set(names))


def test_a_talker_talks(strangers: list[Invented], worker: WorkerFactory) -> None:
    first = strangers[0]
    bench = worker(first.entry_point)
    arguments = {first["actor"]: first["unit"], first["stream"]: first["slot"]}
    call = bench.behave(first["behaviour"], **arguments, **{first["body"]: HOST})
    call.wait_established()
    assert bench.read(first["slot"]).text == first["says"]
    assert call.halt().state == "halted"


def test_a_listener_keeps_what_it_heard(strangers: list[Invented], worker: WorkerFactory) -> None:
    last = strangers[-1]
    bench = worker(last.entry_point)
    arguments = {last["actor"]: last["unit"], last["stream"]: "wire"}
    call = bench.behave(
        last["behaviour"], **arguments, **{last["goal_thing"]: last["thing"], last["body"]: HOST}
    )
    bench.feed(Text(Header(), "so it is"), stream="wire")
    call.assert_succeeded()
    assert bench.wait_fact(last["heard"], last["unit"], "wire").text == "so it is"


def test_a_sentence_needs_both_strangers(strangers: list[Invented]) -> None:
    mouth, ear = strangers[1], strangers[2]
    stream = mouth.object(HOST, "slot")
    assert plan([mouth, ear], sentence(ear), is_words=True) == [
        f"{mouth.schema} {mouth.object(HOST, 'unit')} {stream} {HOST}",
        f"{ear.schema} {ear.object(HOST, 'unit')} {stream} {ear['thing']} {HOST}",
    ]
    assert plan([ear], sentence(ear), is_words=True) is None


def test_a_goal_says_who_listens_to_whom(strangers: list[Invented]) -> None:
    mouths, ears = strangers[:2], strangers[2:]

    def wires(*pairs: tuple[Invented, Invented]) -> set[tuple[str, str]]:
        goal = " ".join(
            f"({ear['heard']} {ear.object(HOST, 'unit')} {mouth.object(HOST, 'slot')})"
            for ear, mouth in pairs
        )
        steps = plan(strangers, f"(and {goal})") or []
        split = [step.split() for step in steps]
        return {(s[1], s[2]) for s in split if s[0] in {ear.schema for ear in ears}}

    straight = wires((ears[0], mouths[0]), (ears[1], mouths[1]))
    swapped = wires((ears[0], mouths[1]), (ears[1], mouths[0]))
    units = [ear.object(HOST, "unit") for ear in ears]
    slots = [mouth.object(HOST, "slot") for mouth in mouths]
    assert straight == {(units[0], slots[0]), (units[1], slots[1])}
    assert swapped == {(units[0], slots[1]), (units[1], slots[0])}


@pytest.mark.slow
def test_a_payload_is_built(strangers: list[Invented], tmp_path: Path) -> None:
    options = Options(targets=(Target.here(),), libraries=(ROOT / "plugins/sdk",))
    mouth = strangers[0]
    folder = build(mouth.folder, tmp_path / "drive", options, lambda *_: None)
    assert folder == tmp_path / "drive/nondum" / mouth.payload_id
    assert not verify(folder, UnsignedAllowed()).problems
    index = json.loads((folder / "index.json").read_text(encoding="utf-8"))
    said = describe(load(mouth.entry_point, mouth["distribution"])).to_dict()
    assert index["components"][mouth["component"]] == said | {"version": "1.0"}
