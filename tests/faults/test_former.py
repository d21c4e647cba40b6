"""What payloads could do outlives them and the daemon, so that the missing one can be named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.host.cli.daemon import BEACON, BEACON_ID, Daemon, killed, running
from tests.kit.payloads import Part

LIT = "(lit self)"
ADVICE = {"payload": BEACON_ID, "plan": ["test-beacon.shine"]}


def bring_and_ask(daemon: Daemon) -> None:
    """A beacon shines because it was asked to."""
    daemon.plug(BEACON_ID, Part("beacon", BEACON))
    daemon.until_state(BEACON_ID, "active")
    daemon.run("goal", "--pddl", LIT, "--maintain", "--wait").ok()


def until_suspended(daemon: Daemon) -> None:
    daemon.until(lambda view: [goal["state"] for goal in view["goals"]] == ["suspended"])


def until_gone(daemon: Daemon) -> None:
    daemon.until(lambda view: not view["payloads"] and not view["drives"])


def advised(daemon: Daemon, *arguments: str) -> dict[str, Any]:
    """The one payload that would help, and its plan."""
    found = daemon.run("advise", *arguments, "--json").ok().json
    [way] = found["ways"]
    [payload] = way["payloads"]
    assert payload["where"].startswith("here until ")
    plan = [step.partition(" ")[0] for step in way["plan"]]
    return {"payload": payload["payload"], "plan": plan}


@pytest.mark.parametrize("is_daemon_there", [True, False], ids=["before", "after"])
def test_payload_is_named_by_the_next_daemon(tmp_path: Path, is_daemon_there: bool) -> None:
    """Its drive is pulled before the daemon is killed, or after."""
    with killed(tmp_path) as daemon:
        bring_and_ask(daemon)
        if is_daemon_there:
            daemon.pull(BEACON_ID)
            until_gone(daemon)
    (daemon.slots / BEACON_ID).unlink(missing_ok=True)
    with running(tmp_path) as daemon:
        until_gone(daemon)
        until_suspended(daemon)
        shown = daemon.run("why").ok().out
        assert f"plug in {BEACON_ID} 1.0" in shown
        assert f"goal 1: {BEACON_ID} 1.0 (here until " in shown
        assert "would do: test-beacon.shine; see `nondum advise 1`" in shown
        assert advised(daemon, LIT) == advised(daemon, "1") == advised(daemon, "shine") == ADVICE


def test_payload_that_is_back_is_no_advice(tmp_path: Path) -> None:
    with killed(tmp_path) as daemon:
        bring_and_ask(daemon)
    with running(tmp_path) as daemon:
        daemon.until(lambda view: any(goal["holds"] for goal in view["goals"]))
        assert daemon.run("advise", "(greeted person self)", "--json").json["known"] == 0


def test_forgotten_payload_is_named_no_more(tmp_path: Path) -> None:
    with killed(tmp_path) as daemon:
        bring_and_ask(daemon)
        daemon.pull(BEACON_ID)
        until_suspended(daemon)
        until_gone(daemon)
        daemon.run("payload", "forget", BEACON_ID).ok()
        daemon.run("payload", "forget", BEACON_ID).refused(1, "FORGET_UNKNOWN")
    with running(tmp_path) as daemon:
        until_suspended(daemon)
        shown = daemon.run("why").ok().out
        assert BEACON_ID not in shown
        assert "goal 1: no payload that is known of would help; see `nondum advise 1`" in shown
