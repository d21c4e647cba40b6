"""Two components that offer the same are alternatives: when one goes, the other takes over."""

from __future__ import annotations

import os
import signal
from dataclasses import replace

import pytest
from tests.daemon.plugins import scribe, talker
from tests.kit.payloads import Part
from tests.kit.running_host import READY_S, Row, RunningHost, steps

pytestmark = pytest.mark.daemon


def test_task_goes_on_with_the_other_when_one_is_pulled(host: RunningHost) -> None:
    host.bring("write", scribe())
    for name in ("left", "right"):
        host.bring(name, talker(name))
    goal = host.want("(written spot)")
    host.until_goal(goal, "holds")
    used = used_talker(host)
    other = {"left": "right", "right": "left"}[used]
    pids = {row["component"]: row["pid"] for row in host.view["components"]}
    seen = len(host.views)
    host.pull(used)
    host.until_gone(used)
    host.until("the other talks", lambda v: used_in(steps(v)) == other, timeout_s=READY_S)
    host.until_goal(goal, "holds")
    states = {row["state"] for view in host.views[seen:] for row in view["goals"]}
    assert "suspended" not in states
    assert host.until_told("plan for '(written spot)', because")
    kept = {row["component"]: row["pid"] for row in host.view["components"]}
    assert kept == {name: pid for name, pid in pids.items() if name != used}
    host.until("the other is heard", read_by_scribe_alone, timeout_s=READY_S)


def test_alternative_that_comes_later_leaves_the_task_alone(host: RunningHost) -> None:
    host.bring("write", scribe())
    host.bring("left", talker("left"))
    goal = host.want("(written spot)")
    host.until_goal(goal, "holds")
    host.bring("right", talker("right"))
    host.until_told("right is here")
    ended = [entry for entry in host.journal() if entry["event"] == "BehaviourEnded"]
    assert used_talker(host) == "left"
    assert not ended


def test_next_goal_takes_the_better_one_and_the_other_when_it_is_killed(host: RunningHost) -> None:
    host.bring("write", scribe())
    host.bring("dear", costing(talker("dear"), 60))
    goal = host.want("(written spot)")
    host.until_goal(goal, "holds")
    host.bring("cheap", costing(talker("cheap"), 30))
    assert used_talker(host) == "dear"
    host.ask("halt", id=goal)
    goal = host.want("(written spot)")
    host.until_goal(goal, "holds")
    assert used_talker(host) == "cheap"
    cheap = host.component("cheap")
    assert cheap is not None
    os.kill(cheap["pid"], signal.SIGKILL)
    host.until("the other talks", lambda v: used_in(steps(v)) == "dear", timeout_s=READY_S)
    host.until_told("cheap is ready")
    host.until_goal(goal, "holds")
    assert used_talker(host) == "dear"


def costing(part: Part, cost: int) -> Part:
    """A talker whose action says what it costs."""
    effect = f"(from ?o ?h) (increase (total-cost) {cost})"
    head, tail = part.source.rsplit("(from ?o ?h)", 1)
    return replace(part, source=f"{head}{effect}{tail}")


def used_talker(host: RunningHost) -> str:
    """The talker in the plan."""
    used = used_in(steps(host.view))
    assert used is not None
    return used


def used_in(plan: dict[str, str]) -> str | None:
    """The talker whose step is established."""
    running = (action for action, state in plan.items() if state == "established")
    names = [action.split("__")[1] for action in running if ".talk " in action]
    return names[0] if names else None


def read_by_scribe_alone(view: Row) -> bool:
    """Whether there is one stream, and the scribe alone reads it."""
    return [stream["consumers"] for stream in view["streams"]] == [["scribe"]]
