"""Two components that offer the same are alternatives: when one goes, the other takes over."""

from __future__ import annotations

import pytest
from tests.lab.plugins import scribe, talker
from tests.lab.running_host import RunningHost, steps

pytestmark = pytest.mark.lab


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
    host.until("the other talks", lambda v: used_in(steps(v)) == other, timeout_s=20)
    host.until_goal(goal, "holds")
    states = {row["state"] for view in host.views[seen:] for row in view["goals"]}
    assert "suspended" not in states
    assert host.until_told("plan for '(written spot)', because")
    kept = {row["component"]: row["pid"] for row in host.view["components"]}
    assert kept == {name: pid for name, pid in pids.items() if name != used}
    (stream,) = host.view["streams"]
    assert stream["consumers"] == ["scribe"]


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
