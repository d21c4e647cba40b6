"""What hosts do for others while the cable between them is pulled, and after it is back."""

from __future__ import annotations

import random
import threading
from pathlib import Path

import pytest
from tests.daemon.neighbours import until_shared
from tests.daemon.peer_faults.daemons import WiredHost, lamp, until_written, wired

pytestmark = pytest.mark.daemon


@pytest.mark.parametrize(
    ("when_lost", "meanwhile", "in_the_end"),
    [
        ("stop", ["on", "off"], ["on", "off", "on"]),
        ("hold", ["on"], ["on", "off", "on"]),
        ("finish", ["on"], ["on", "off", "on"]),
    ],
)
def test_what_lasts_ends_as_declared_and_is_pursued_again(
    when_lost: str, meanwhile: list[str], in_the_end: list[str], tmp_path: Path
) -> None:
    log = tmp_path / "log"
    with wired(tmp_path, "rover", "mule") as (rover, mule):
        mule.bring("light", lamp(log, when_lost=when_lost))
        until_shared(rover, "lamp@mule")
        goal = rover.want("(lit rover)")
        rover.until_goal(goal, "holds")
        mule.cable.pull()
        part(rover, mule)
        rover.until_goal(goal, "suspended")
        until_written(log, *meanwhile)
        mule.cable.put_back()
        rover.until_goal(goal, "holds")
        until_written(log, *in_the_end)
        rover.ask("halt", id=goal)
        until_written(log, *in_the_end, "off")


@pytest.mark.parametrize(
    ("when_lost", "meanwhile"), [("stop", ["begun", "halted"]), ("finish", ["begun", "done"])]
)
def test_what_ends_by_itself_ends_as_declared_and_is_done_again(
    when_lost: str, meanwhile: list[str], tmp_path: Path
) -> None:
    log = tmp_path / "log"
    with wired(tmp_path, "rover", "mule") as (rover, mule):
        mule.bring("light", lamp(log, when_lost=when_lost))
        until_shared(rover, "lamp@mule")
        goal = rover.want("(warned rover)", kind="achieve")
        until_written(log, "begun")
        mule.cable.pull()
        part(rover, mule)
        until_written(log, *meanwhile)
        mule.cable.put_back()
        rover.until_goal(goal, "reached")
        until_written(log, *meanwhile, "begun", "done")


def test_flaps_noticed_or_not_have_nothing_run_twice(seed: int, tmp_path: Path) -> None:
    log, chance, pause = tmp_path / "log", random.Random(seed), threading.Event()
    with wired(tmp_path, "rover", "mule") as (rover, mule):
        mule.bring("light", lamp(log, when_lost="stop"))
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
        times = log.read_text(encoding="utf-8").split().count("on")
        until_written(log, *("on", "off") * times)


def test_another_host_steps_in_for_the_one_that_is_lost(tmp_path: Path) -> None:
    logs = {name: tmp_path / f"{name}.log" for name in ("mule", "base")}
    with wired(tmp_path, "rover", "mule", "base") as (rover, mule, base):
        for host in (mule, base):
            host.bring("light", lamp(logs[host.name], when_lost="stop"))
            until_shared(rover, f"lamp@{host.name}")
        goal = rover.want("(lit rover)")
        rover.until_goal(goal, "holds")
        first, second = (mule, base) if logs["mule"].exists() else (base, mule)
        first.cable.pull()
        until_written(logs[first.name], "on", "off")
        until_written(logs[second.name], "on")
        rover.until_goal(goal, "holds")
        first.cable.put_back()
        until_shared(rover, f"lamp@{first.name}")
        until_shared(base if first is mule else mule, f"lamp@{first.name}")
        until_written(logs[first.name], "on", "off")
        until_written(logs[second.name], "on")


def part(one: WiredHost, other: WiredHost) -> None:
    """Wait until two hosts have lost each other."""
    one.until_told(f"the host {other.name} is gone")
    other.until_told(f"the host {one.name} is gone")
