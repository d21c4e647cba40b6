"""What hosts do for others while the cable between them is pulled, and after it is back."""

from __future__ import annotations

import random
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.daemon.neighbours import until_shared
from tests.daemon.peer_faults.daemons import Log, WiredHost, clear, wired

pytestmark = pytest.mark.daemon


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[WiredHost]]:
    with wired(tmp_path_factory.mktemp("fleet"), "rover", "mule", "base") as hosts:
        yield hosts


@pytest.fixture
def hosts(fleet: list[WiredHost]) -> Iterator[list[WiredHost]]:
    """Hosts that have found each other, with nothing plugged in."""
    yield fleet
    clear(fleet)


@pytest.mark.parametrize(
    ("when_lost", "meanwhile", "in_the_end"),
    [
        ("stop", ["on", "off"], ["on", "off", "on"]),
        ("hold", ["on"], ["on", "off", "on"]),
        ("finish", ["on"], ["on", "off", "on"]),
    ],
)
def test_what_lasts_ends_as_declared_and_is_pursued_again(
    when_lost: str,
    meanwhile: list[str],
    in_the_end: list[str],
    hosts: list[WiredHost],
    tmp_path: Path,
) -> None:
    rover, mule, _ = hosts
    log = Log(tmp_path / "log")
    mule.bring(f"lasting-{when_lost}", log.lamp(when_lost=when_lost))
    until_shared(rover, "lamp@mule")
    goal = rover.want("(lit rover)")
    rover.until_goal(goal, "holds")
    pull_cable(mule, rover)
    rover.until_goal(goal, "suspended")
    log.until(*meanwhile)
    mule.cable.put_back()
    rover.until_goal(goal, "holds")
    log.until(*in_the_end)
    rover.ask("halt", id=goal)
    log.until(*in_the_end, "off")


@pytest.mark.parametrize(("when_lost", "last_word"), [("stop", "halted"), ("finish", "done")])
def test_what_ends_by_itself_ends_as_declared_and_is_done_again(
    when_lost: str, last_word: str, hosts: list[WiredHost], tmp_path: Path
) -> None:
    rover, mule, _ = hosts
    log = Log(tmp_path / "log")
    mule.bring(f"ending-{when_lost}", log.lamp(when_lost=when_lost))
    until_shared(rover, "lamp@mule")
    goal = rover.want("(warned rover)", kind="achieve")
    log.until("begun")
    pull_cable(mule, rover)
    if when_lost == "finish":
        log.end_signal()
    log.until("begun", last_word)
    mule.cable.put_back()
    log.until("begun", last_word, "begun")
    log.end_signal()
    rover.until_goal(goal, "reached")
    log.until("begun", last_word, "begun", "done")


def test_flaps_noticed_or_not_have_nothing_run_twice(
    seed: int, hosts: list[WiredHost], tmp_path: Path
) -> None:
    rover, mule, _ = hosts
    log, chance, pause = Log(tmp_path / "log"), random.Random(seed), threading.Event()
    mule.bring("flapping", log.lamp(when_lost="stop"))
    until_shared(rover, "lamp@mule")
    goal = rover.want("(lit rover)")
    rover.until_goal(goal, "holds")
    for host in chance.choices((rover, mule), k=8):
        host.cable.pull()
        pause.wait(chance.uniform(0.0, 0.08))
        host.cable.put_back()
        pause.wait(0.5)
    until_shared(rover, "lamp@mule")
    rover.until_goal(goal, "holds")
    rover.ask("halt", id=goal)
    log.until(*("on", "off") * log.words.count("on"))


def test_another_host_steps_in_for_the_one_that_is_lost(
    hosts: list[WiredHost], tmp_path: Path
) -> None:
    rover, mule, base = hosts
    logs = {name: Log(tmp_path / name) for name in ("mule", "base")}
    for host in (mule, base):
        host.bring(f"spare-{host.name}", logs[host.name].lamp(when_lost="stop"))
        until_shared(rover, f"lamp@{host.name}")
    goal = rover.want("(lit rover)")
    rover.until_goal(goal, "holds")
    first, second = (mule, base) if logs["mule"].words else (base, mule)
    first.cable.pull()
    logs[first.name].until("on", "off")
    logs[second.name].until("on")
    rover.until_goal(goal, "holds")
    first.cable.put_back()
    until_shared(rover, f"lamp@{first.name}")
    until_shared(base if first is mule else mule, f"lamp@{first.name}")
    logs[first.name].until("on", "off")
    logs[second.name].until("on")


def pull_cable(host: WiredHost, other: WiredHost) -> None:
    """Pull a host's cable, and wait until it and another one have lost each other."""
    before = {one: one.told_number() for one in (host, other)}
    host.cable.pull()
    host.until_told(f"the host {other.name} is gone", since=before[host])
    other.until_told(f"the host {host.name} is gone", since=before[other])
