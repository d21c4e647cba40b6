"""A payload is upgraded while the robot works with it, goes back, and goes."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace
from typing import Any

import pytest
from demo.robot import NONDUM, View
from tests.daemon.plugins import TALKER, scribe, talker
from tests.kit.payloads import Part, make_payload
from tests.kit.running_host import READY_S, RunningHost
from tests.kit.until import until

pytestmark = pytest.mark.daemon

TALK = "org.example.talk"

FALLS = (
    TALKER
    + """
@hookimpl
def start(ctx):
    import os, threading
    threading.Timer(0.3, os._exit, (3,)).start()
"""
)


def plug(host: RunningHost, release: int, part: Part | None = None) -> None:
    """Plug in a release of the talker."""
    drive = host.work / "drives" / f"talk-{release}"
    version = f"{release}.0"
    part = replace(part or talker(), version=version)
    make_payload(drive, part, payload_id=TALK, version=version, release=release)
    host.plug(drive)


def until_states(host: RunningHost, **wanted: str) -> View:
    """Wait until releases of the talker (`r1=…`) are in these states, and no others are there."""

    def found(view: View) -> View | None:
        states = {f"r{r['release']}": r["state"] for r in view["payloads"] if r["payload"] == TALK}
        return view if states == wanted else None

    return host.until(f"releases: {wanted}", found, timeout_s=READY_S)


def until_holds_with(host: RunningHost, version: str, goal: str) -> None:
    """Wait until the goal holds, with the talker of a version."""

    def found(view: View) -> bool:
        return versions(view).get("talker") == version

    host.until(f"talker {version}", found, timeout_s=READY_S)
    until("it is written what that talker says", lambda: is_written_since_activation(host))
    host.until_goal(goal, "holds")


def is_written_since_activation(host: RunningHost) -> bool:
    """Whether the scribe's behaviour was established after the last activation of a talker. What
    used the talker before has ended by then; the view may still show that for a moment."""
    rows = [(row["event"], row["subject"]) for row in host.journal()]
    activated = max(n for n, row in enumerate(rows) if row == ("PayloadActivated", TALK))
    return ("BehaviourEstablished", "scribe") in rows[activated:]


def versions(view: View) -> dict[str, str]:
    return {row["component"]: row["version"] for row in view["components"]}


def ended_behaviours(host: RunningHost) -> int:
    return [entry["event"] for entry in host.journal()].count("BehaviourEnded")


def nondum(host: RunningHost, *arguments: str) -> Any:
    """What a person's command prints."""
    command = [*NONDUM, "--control", str(host.control), *arguments, "--json"]
    done = subprocess.run(command, capture_output=True, text=True)
    return json.loads(done.stdout or done.stderr)


def test_robot_goes_on_through_upgrades_and_back(host: RunningHost) -> None:
    before = host.traces()
    host.bring("write", scribe())
    plug(host, 1)
    until_states(host, r1="active")
    goal = host.want("(written spot)")
    until_holds_with(host, "1.0", goal)
    pen = next(row["pid"] for row in host.view["components"] if row["component"] == "scribe")
    seen = len(host.views)

    plug(host, 2)
    host.until_told(f"{TALK} 2.0 is being brought up beside 1.0")
    until_states(host, r1="superseded", r2="active")
    host.until_told(f"{TALK} 2.0 (release 2) took over from release 1")
    until_holds_with(host, "2.0", goal)
    (row,) = (row for row in host.ask("components") if row["component"] == "talker")
    assert (row["release"], row["was"]) == (2, 1)
    rows = [row for view in host.views[seen:] for row in view["components"]]
    assert not any(row["problem"] for row in rows), "that release 1 ended is no failure"

    ended = ended_behaviours(host)
    plug(host, 3, Part("talker", FALLS))
    view = until_states(host, r1="superseded", r2="active", r3="quarantined")
    (broken,) = (row for row in view["payloads"] if row["release"] == 3)
    assert broken["codes"] == ["WORKER_EXITED"]
    host.until_told("2.0 (release 2) stays")
    assert ended_behaviours(host) == ended, "what ran never noticed"
    assert any("exited with status 3" in problem for problem in host.ask("why")["problems"])

    back = nondum(host, "payload", "rollback", TALK)
    assert (back["version"], back["state"], back["was"]) == ("1.0", "active", 2)
    until_holds_with(host, "1.0", goal)
    host.until_told(f"a person goes back to {TALK} 1.0 (release 1) from release 2")
    assert any("a person went back to it" in w for w in host.ask("status")["warnings"])
    assert [e["event"] for e in host.journal(TALK)].count("RollbackAsked") == 1
    assert nondum(host, "payload", "rollback", TALK)["problems"][0]["code"] == "ROLLBACK_NOTHING"

    shown = host.views[seen:]
    assert all("talker" in versions(view) for view in shown), "it was never without"
    assert "suspended" not in {row["state"] for view in shown for row in view["goals"]}
    assert {r["pid"] for v in shown for r in v["components"] if r["component"] == "scribe"} == {pen}

    host.ask("halt", id=goal)
    for release in (3, 2, 1):
        host.pull(f"talk-{release}")
    until_states(host)
    host.pull("write")
    host.until_gone("write")
    assert host.traces() == before
