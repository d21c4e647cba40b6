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
FOLDERS = ("host", "planning", "transport", "wheelhouse", "plugins/sdk")


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
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*")
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


def test_a_listener_keeps_the_message(strangers: list[Invented], worker: WorkerFactory) -> None:
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
    sender, receiver = strangers[1], strangers[2]
    stream = sender.object(HOST, "slot")
    assert plan([sender, receiver], sentence(receiver), is_words=True) == [
        f"{sender.schema} {sender.object(HOST, 'unit')} {stream} {HOST}",
        f"{receiver.schema} {receiver.object(HOST, 'unit')} {stream} {receiver['thing']} {HOST}",
    ]
    assert plan([receiver], sentence(receiver), is_words=True) is None


def test_a_goal_says_which_listener_reads_which_talker(strangers: list[Invented]) -> None:
    senders, receivers = strangers[:2], strangers[2:]

    def wires(*pairs: tuple[Invented, Invented]) -> set[tuple[str, str]]:
        goal = " ".join(
            f"({receiver['heard']} {receiver.object(HOST, 'unit')} {sender.object(HOST, 'slot')})"
            for receiver, sender in pairs
        )
        steps = plan(strangers, f"(and {goal})") or []
        split = [step.split() for step in steps]
        return {(s[1], s[2]) for s in split if s[0] in {receiver.schema for receiver in receivers}}

    straight = wires((receivers[0], senders[0]), (receivers[1], senders[1]))
    swapped = wires((receivers[0], senders[1]), (receivers[1], senders[0]))
    units = [receiver.object(HOST, "unit") for receiver in receivers]
    slots = [sender.object(HOST, "slot") for sender in senders]
    assert straight == {(units[0], slots[0]), (units[1], slots[1])}
    assert swapped == {(units[0], slots[1]), (units[1], slots[0])}


@pytest.mark.slow
def test_a_payload_is_built(strangers: list[Invented], tmp_path: Path) -> None:
    options = Options(targets=(Target.here(),), libraries=(ROOT / "plugins/sdk",))
    sender = strangers[0]
    folder = build(sender.folder, tmp_path / "drive", options, lambda *_: None)
    assert folder == tmp_path / "drive/nondum" / sender.payload_id
    assert not verify(folder, UnsignedAllowed()).problems
    index = json.loads((folder / "index.json").read_text(encoding="utf-8"))
    said = describe(load(sender.entry_point, sender["distribution"])).to_dict()
    assert index["components"][sender["component"]] == said | {"version": "1.0"}
