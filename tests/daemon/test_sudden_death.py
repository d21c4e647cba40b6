"""Daemons and workers are killed in the middle of things, and what was there comes back."""

from __future__ import annotations

import os
import signal

import pytest
from tests.daemon.plugins import scribe, talker
from tests.kit.descendants import descendants
from tests.kit.running_host import Row, RunningHost, until_ended
from tests.kit.traces import Traces, former_payloads

pytestmark = pytest.mark.daemon


@pytest.mark.parametrize("is_acting", [False, True], ids=["idle", "acting"])
def test_killed_daemon_comes_back_with_the_same_components(
    own_host: RunningHost, *, is_acting: bool
) -> None:
    host = own_host
    host.bring("write", scribe())
    host.bring("talk", talker())
    if is_acting:
        host.until_goal(host.want("(written spot)"), "holds")
    components, traces, below = without_pids(host), host.traces(), descendants(host.pid)
    host.kill()
    for pid in below:
        until_ended(pid)
    host.start()
    host.until_step("write", "active")
    host.until_step("talk", "active")
    assert without_pids(host) == components
    assert places(host.traces()) == places(traces)
    host.until_goal(host.want("(written spot)"), "holds")
    for name in ("write", "talk"):
        host.pull(name)
        host.until_gone(name)
    left = host.traces()
    assert places(left) == ((), (), (), ())
    assert {table for table, _ in left.rows} == {"goals"}, "what was asked for is still wanted"
    assert former_payloads(host.state) == {
        "org.example.write": {"scribe"},
        "org.example.talk": {"talker"},
    }


def test_nothing_temporary_is_left_of_a_daemon_that_was_killed(own_host: RunningHost) -> None:
    host = own_host
    host.kill()
    for left in ("planning/planner-of-before", "probes/nondum-probe-1"):
        (host.state / left / "inner").mkdir(parents=True)
    host.start()
    assert not (host.state / "planning/planner-of-before").exists()
    assert not (host.state / "probes/nondum-probe-1").exists()


def test_killed_worker_is_started_again_and_all_else_goes_on(host: RunningHost) -> None:
    host.bring("write", scribe())
    host.bring("talk", talker())
    goal = host.want("(written spot)")
    host.until_goal(goal, "holds")
    writer = host.component("scribe")
    kill_worker(host, "talker")
    host.until_told("talker is not ready, it is restarting")
    host.until_told("talker is ready")
    host.until_goal(goal, "holds")
    assert host.component("scribe") == writer


def test_worker_that_is_killed_too_often_is_quarantined_until_replugged(host: RunningHost) -> None:
    host.bring("write", scribe())
    drive = host.bring("talk", talker())
    writer = host.component("scribe")
    for _ in range(3):
        kill_worker(host, "talker")
        host.until_component("talker", "restarting")
        host.until_component("talker", "ready")
    kill_worker(host, "talker")
    row = host.until_component("talker", "quarantined")
    assert row["problem"].startswith("WORKER_CRASH_LOOP")
    assert host.until_told("talker is not ready, it is quarantined: WORKER_CRASH_LOOP")
    assert "WORKER_CRASH_LOOP" in str(host.ask("why")["problems"])
    assert host.component("scribe") == writer
    goal = host.want("(written spot)")
    host.until_goal(goal, "suspended")
    host.pull("talk")
    host.until_gone("talk")
    host.plug(drive)
    host.until_goal(goal, "holds")
    assert host.component("scribe") == writer


def kill_worker(host: RunningHost, component: str) -> None:
    """SIGKILL a component's worker, and see it end."""
    row = host.component(component)
    assert row is not None
    os.kill(row["pid"], signal.SIGKILL)
    until_ended(row["pid"])


def without_pids(host: RunningHost) -> list[Row]:
    """All components, as two daemons may both show them."""
    return sorted(({**row, "pid": None} for row in host.components()), key=str)


def places(traces: Traces) -> tuple[object, ...]:
    """Files and processes of a host; its rows are left out, for they hold times and counts."""
    return traces.workers, traces.opened, traces.mounts, traces.folders
