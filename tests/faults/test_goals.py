"""What people asked for outlives the daemon; what is over does not come back."""

from __future__ import annotations

from pathlib import Path

from demo.robot import View
from tests.kit.beacon import BEACON
from tests.kit.payloads import Part
from tests.kit.running_host import RunningHost, running


def goals(view: View) -> dict[str, tuple[str, str]]:
    return {row["text"]: (row["id"], row["state"]) for row in view["goals"]}


def until(host: RunningHost, wanted: dict[str, str]) -> dict[str, tuple[str, str]]:
    """Wait until each of these goals, by its text, is in its state; give all goals."""

    def look(view: View) -> dict[str, tuple[str, str]] | None:
        found = goals(view)
        is_so = all(text in found and found[text][1] == state for text, state in wanted.items())
        return found if is_so else None

    return host.until(f"goals are {wanted}", look)


def test_open_goals_survive_a_daemon_that_is_killed(tmp_path: Path) -> None:
    waiting = "(reported person panther)"
    wanted = {"shine": "active", waiting: "suspended"}
    with running(tmp_path, name="panther") as host:
        host.bring("beacon", Part("beacon", BEACON))
        host.run("goal", "shine", "--wait").ok()
        host.run("goal", "greet people", "--wait").ok()
        host.run("goal", "--pddl", waiting, "--priority", "2").ok()
        halted = host.run("goal", "--pddl", "(found person self)", "--json").ok().json["id"]
        host.run("halt", "--goal", halted).ok()
        before = until(host, wanted)
        host.kill()
        host.start()
        after = until(host, wanted)
        assert after == {text: before[text] for text in wanted}
        host.until("a goal holds", lambda view: any(row["holds"] for row in view["goals"]))
        given = host.run("goal", "greet people", "--wait", "--json").ok().json
        assert int(given["id"]) > max(int(id) for id, _ in after.values())
        assert host.stop() == 0
        host.start()  # one that ended well has kept them too
        assert until(host, wanted) == after
