"""What people asked for outlives the daemon; what is over does not come back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.host.cli.daemon import BEACON, BEACON_ID, Daemon, killed, running
from tests.kit.payloads import Part


def goals(view: dict[str, Any]) -> dict[str, tuple[str, str]]:
    return {row["text"]: (row["id"], row["state"]) for row in view["goals"]}


def until(daemon: Daemon, wanted: dict[str, str]) -> dict[str, tuple[str, str]]:
    """Wait until each of these goals, by its text, is in its state; give all goals."""

    def is_so(view: dict[str, Any]) -> bool:
        found = goals(view)
        return all(text in found and found[text][1] == state for text, state in wanted.items())

    return goals(daemon.until(is_so))


def test_open_goals_survive_a_daemon_that_is_killed(tmp_path: Path) -> None:
    waiting = "(reported person panther)"
    with killed(tmp_path) as daemon:
        daemon.plug(BEACON_ID, Part("beacon", BEACON))
        daemon.until_state(BEACON_ID, "active")
        daemon.run("goal", "shine", "--wait").ok()
        daemon.run("goal", "greet people", "--wait").ok()
        daemon.run("goal", "--pddl", waiting, "--priority", "2").ok()
        halted = daemon.run("goal", "--pddl", "(found person self)", "--json").ok().json["id"]
        daemon.run("halt", "--goal", halted).ok()
        before = until(daemon, {"shine": "active", waiting: "suspended"})
    wanted = {"shine": "active", waiting: "suspended"}
    with running(tmp_path) as daemon:
        after = until(daemon, wanted)
        assert after == {text: before[text] for text in wanted}
        daemon.until(lambda view: any(row["holds"] for row in view["goals"]))
        given = daemon.run("goal", "greet people", "--wait", "--json").ok().json
        assert int(given["id"]) > max(int(id) for id, _ in after.values())
    with running(tmp_path) as daemon:  # one that ended well has kept them too
        assert until(daemon, wanted) == after
