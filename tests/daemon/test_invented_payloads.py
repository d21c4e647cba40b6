"""A whole host takes in payloads of random words, and does with them what it is asked for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random

import pytest
from demo.robot import Robot, View, running
from demo.shuffle.words import Words
from tests.demo.invented import Invented, listener, sentence, talker

from nondum.wheelhouse.build.build import Options, build
from nondum.wheelhouse.format.target import Target

pytestmark = [pytest.mark.daemon, pytest.mark.slow]

SDK = Path(__file__).parents[2] / "plugins/sdk"
READY_S, GOAL_S = 120.0, 120.0


@dataclass(frozen=True)
class Stranger:
    """An invented plugin and its drive."""

    plugin: Invented
    drive: Path


@pytest.fixture(scope="module")
def strangers(tmp_path_factory: pytest.TempPathFactory, seed: int) -> list[Stranger]:
    """Two talkers and two listeners under random names."""
    folder, words = tmp_path_factory.mktemp("invented"), Words(seed)
    options = Options(targets=(Target.here(),), libraries=(SDK,))
    made = []
    for write in (talker, talker, listener, listener):
        plugin = write(folder / "sources", words)
        drive = folder / "drives" / words.word()
        build(plugin.folder, drive, options, lambda *_: None)
        made.append(Stranger(plugin, drive))
    return made


@pytest.fixture
def robot(tmp_path: Path, seed: int) -> Iterator[Robot]:
    with running(tmp_path, name=Words(-seed).word(), initial={}) as robot:
        yield robot


def plug(robot: Robot, seed: int, *strangers: Stranger) -> None:
    """Plug drives in, in the order that the seed gives, and wait until all are in use."""
    wanted = {stranger.plugin.payload_id for stranger in strangers}
    for stranger in Random(seed).sample(strangers, len(strangers)):
        robot.plug(stranger.drive)

    def all_active(view: View) -> bool:
        return wanted <= {p["payload"] for p in view["payloads"] if p["state"] == "active"}

    robot.until("payloads active", all_active, timeout_s=READY_S)


def reach(robot: Robot, **goal: str) -> list[str]:
    """Give a goal and wait until it is reached; the actions of the plans seen on the way."""
    given = robot.ask("goal", **goal)
    seen: dict[str, None] = {}

    def is_reached(view: View) -> bool:
        if view["plan"].get("id") == given["id"]:
            seen.update(dict.fromkeys(step["action"] for step in view["plan"]["steps"]))
        return any(g["id"] == given["id"] and g["state"] == "reached" for g in view["goals"])

    robot.until(f"reached: {goal}", is_reached, timeout_s=GOAL_S)
    return list(seen)


def received(robot: Robot, receiver: Stranger, sender: Stranger) -> str | None:
    """What a listener says that it received on a talker's stream."""
    rows = {row["fact"]: row for row in robot.ask("facts")}
    row = rows.get(fact(robot, receiver, sender))
    return None if row is None else str(row["value"][1]["text"])


def fact(robot: Robot, receiver: Stranger, sender: Stranger) -> str:
    """That a listener heard a talker's stream."""
    unit = receiver.plugin.object(robot.name, "unit")
    return f"{receiver.plugin['heard']} {unit} {sender.plugin.object(robot.name, 'slot')}"


def test_a_sentence_is_carried_out_by_strangers(
    robot: Robot, strangers: list[Stranger], seed: int
) -> None:
    sender, receiver = strangers[0], strangers[2]
    plug(robot, seed, sender, receiver)
    reach(robot, words=sentence(receiver.plugin))
    assert received(robot, receiver, sender) == sender.plugin["says"]
    done = f"{receiver.plugin['done']} {receiver.plugin['thing']} {robot.name}"
    assert done in {row["fact"] for row in robot.ask("facts")}


def test_swapping_two_objects_in_the_plan_swaps_the_feed(
    robot: Robot, strangers: list[Stranger], seed: int
) -> None:
    senders, receivers = strangers[:2], strangers[2:]
    plug(robot, seed, *strangers)
    for order in (senders, senders[::-1]):
        pairs = list(zip(receivers, order, strict=True))
        facts = " ".join(f"({fact(robot, receiver, sender)})" for receiver, sender in pairs)
        assert not any(received(robot, receiver, sender) for receiver, sender in pairs)
        reach(robot, pddl=f"(and {facts})")
        for receiver, sender in pairs:
            assert received(robot, receiver, sender) == sender.plugin["says"]
