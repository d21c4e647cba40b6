"""What payloads could do outlives them and the daemon, so that the missing one can be named."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from tests.kit.beacon import BEACON, BEACON_ID
from tests.kit.payloads import Part
from tests.kit.running_host import RunningHost, running

LIT = "(lit self)"
ADVICE = {"payload": BEACON_ID, "plan": ["test-beacon.shine"]}


def bring_and_ask(host: RunningHost) -> None:
    """A beacon shines because it was asked to."""
    host.bring("beacon", Part("beacon", BEACON))
    host.run("goal", "--pddl", LIT, "--maintain", "--wait").ok()


def until_suspended(host: RunningHost) -> None:
    host.until(
        "the goal is suspended",
        lambda view: [goal["state"] for goal in view["goals"]] == ["suspended"],
    )


def until_gone(host: RunningHost) -> None:
    host.until("all is gone", lambda view: not view["payloads"] and not view["drives"])


def advised(host: RunningHost, *arguments: str) -> dict[str, Any]:
    """The one payload that would help, and its plan."""
    found = host.run("advise", *arguments, "--json").ok().json
    [way] = found["ways"]
    [payload] = way["payloads"]
    assert payload["where"].startswith("here until ")
    plan = [step.partition(" ")[0] for step in way["plan"]]
    return {"payload": payload["payload"], "plan": plan}


@pytest.mark.parametrize("is_daemon_there", [True, False], ids=["before", "after"])
def test_payload_is_named_by_the_next_daemon(tmp_path: Path, is_daemon_there: bool) -> None:
    """Its drive is pulled before the daemon is killed, or after."""
    with running(tmp_path) as host:
        bring_and_ask(host)
        if is_daemon_there:
            host.pull("beacon")
            until_gone(host)
        host.kill()
        if not is_daemon_there:
            host.pull("beacon")
        host.start()
        until_gone(host)
        until_suspended(host)
        shown = host.run("why").ok().out
        assert f"plug in {BEACON_ID} 1.0" in shown
        assert re.search(rf"goal 1: {BEACON_ID} 1\.0\b.* test-beacon\.shine\b", shown)
        assert advised(host, LIT) == advised(host, "1") == advised(host, "shine") == ADVICE


def test_payload_that_is_back_is_no_advice(tmp_path: Path) -> None:
    with running(tmp_path) as host:
        bring_and_ask(host)
        host.kill()
        host.start()
        host.until("the goal holds", lambda view: any(goal["holds"] for goal in view["goals"]))
        assert host.run("advise", "(greeted person self)", "--json").json["known"] == 0


def test_forgotten_payload_is_named_no_more(tmp_path: Path) -> None:
    with running(tmp_path) as host:
        bring_and_ask(host)
        host.pull("beacon")
        until_suspended(host)
        until_gone(host)
        host.run("payload", "forget", BEACON_ID).ok()
        host.run("payload", "forget", BEACON_ID).refused(1, "FORGET_UNKNOWN")
        host.kill()
        host.start()
        until_suspended(host)
        shown = host.run("why").ok().out
        assert BEACON_ID not in shown
        [advice] = [line for line in shown.splitlines() if line.startswith("goal 1: ")]
        assert "`nondum advise 1`" in advice
