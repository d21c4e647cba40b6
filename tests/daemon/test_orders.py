"""What people order counts at once: halting, and where things are mounted."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import pytest
from demo.robot import nondum
from tests.daemon.plugins import arm, compass, scribe, talker
from tests.kit.descendants import descendants
from tests.kit.running_host import Row, RunningHost, steps

pytestmark = pytest.mark.daemon

BOTH = "(and (raised spot) (waved spot))"


def test_halt_now_needs_no_planner(host: RunningHost) -> None:
    host.bring("write", scribe())
    host.bring("talk", talker())
    goal = host.want("(written spot)")
    host.until_goal(goal, "holds")
    assert planners(host)
    for planner in planners(host):
        os.kill(planner, signal.SIGSTOP)
    host.bring("arm", arm())
    other = host.want("(raised spot)")  # a search that never ends
    halted = json.loads(nondum("--control", host.control, "halt", "--now", "--json"))
    assert halted["goals"] == [goal, other]
    assert {name.split()[0] for name in halted["halted"]} == {
        "test-talker.talk",
        "test-scribe.write",
    }
    host.until_goal(goal, "halted")
    host.until("nothing runs", lambda view: not any_stream(view), timeout_s=60)
    host.until("both have ended", lambda _: {"talker", "scribe"} <= outcomes(host).keys())
    assert set(outcomes(host).values()) == {"HALTED"}
    assert not any(row["running"] for row in host.ask("behaviours"))


def outcomes(host: RunningHost) -> dict[str, str]:
    """How the behaviours that have ended did, by component."""
    ends = [entry for entry in host.journal() if entry["event"] == "BehaviourEnded"]
    return {entry["subject"]: entry["detail"]["outcome"] for entry in ends}


def test_actuator_has_one_user_at_a_time(host: RunningHost) -> None:
    host.bring("left", arm("left"))
    goal = host.want(BOTH)
    host.until_goal(goal, "suspended")
    host.until_told(f"cannot '{BOTH}' now")
    host.bring("right", arm("right"))
    host.until_goal(goal, "holds")
    actors = {action.split()[1] for action, state in steps(host.view).items()}
    assert actors == {"spot__left__arm", "spot__right__arm"}


def test_actuator_has_one_user_at_a_time_though_its_plugin_does_not_ask(host: RunningHost) -> None:
    host.bring("arm", arm(is_rude=True))
    host.until_goal(host.want("(raised spot)"), "holds")
    host.until_goal(host.want(BOTH), "suspended")
    host.until_told("waits for arm, which test-arm.lift arm spot uses")
    for view in host.views:
        assert list(steps(view).values()).count("established") <= 1


def test_mount_that_a_behaviour_needs_is_asked_for_and_then_counts(own_host: RunningHost) -> None:
    host = own_host  # what a person says of a mount stays
    host.bring("compass", compass())
    goal = host.want("(bearing-known north spot)", "achieve")
    host.until_told("FRAME_UNKNOWN no way is known from frame 'needle' to 'spot'")
    host.until_told("→ give the mount pose: nondum mount")
    assert mount(host, "0 0 1.5707963").endswith(
        "__needle is mounted at xyz 0 0 0, rpy 0 0 1.5708\n"
    )
    host.until_goal(goal, "reached")
    assert bearing(host, "north") == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    mount(host, "0 0 0")
    host.until_goal(host.want("(bearing-known south spot)", "achieve"), "reached")
    assert bearing(host, "south") == pytest.approx((1.0, 0.0, 0.0))


def mount(host: RunningHost, rpy: str) -> str:
    """Turn the needle on its body, as a person does."""
    unit = "needle"
    return nondum("--control", host.control, "mount", unit, "--rpy", *rpy.split())


def bearing(host: RunningHost, target: str) -> tuple[float, ...]:
    """The direction of a target in the body's frame, as it is believed."""
    kind, value = host.facts()[f"bearing-known {target} spot"]
    assert (kind, value["header"]["frame_id"]) == ("bearing", "spot")
    return tuple(value["direction"])


def planners(host: RunningHost) -> list[int]:
    """The processes that search for plans: those that their fork server has made."""
    found = {pid: Path(f"/proc/{pid}/cmdline").read_text() for pid in descendants(host.pid)}
    (server,) = (pid for pid in children_of(host.pid) if "planner_child" in found[pid])
    return children_of(server)


def children_of(pid: int) -> list[int]:
    listed = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    return [int(child) for child in listed.split()]


def any_stream(view: Row) -> bool:
    """Whether messages arrive on any stream."""
    return any(stream["flowing"] for stream in view["streams"])
