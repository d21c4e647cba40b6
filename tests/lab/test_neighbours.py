"""What one host can do, another one plans with and uses, until either is gone."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.lab.neighbours import beacon, neighbours, until_shared, written
from tests.lab.running_host import READY_S, RunningHost

pytestmark = pytest.mark.lab


def component(host: RunningHost, id: str) -> bool:
    return any(row["component"] == id for row in host.view["components"])


def test_what_is_plugged_into_one_host_is_used_by_the_other(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with neighbours(tmp_path, "rover", "mule") as (rover, mule):
        mule.bring("light", beacon(log))
        until_shared(rover, "beacon@mule")
        goal = rover.want("(lit rover)")
        rover.until_goal(goal, "holds")
        assert written(log) == ["on"]
        rover.ask("halt", id=goal)
        rover.until("nothing runs", lambda v: not v["plan"]["steps"], timeout_s=READY_S)
        mule.until("it is free again", lambda _: written(log) == ["on", "off"], timeout_s=READY_S)


def test_phrase_of_a_peers_component_is_understood(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with neighbours(tmp_path, "rover", "mule") as (rover, mule):
        mule.bring("light", beacon(log))
        until_shared(rover, "beacon@mule")
        given = rover.ask("goal", words="blink")
        rover.until_goal(given["id"], "reached")
        assert written(log) == ["blink"]
