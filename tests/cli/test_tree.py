"""`nondum tree` asked of a real host that pursues a goal."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from typing import Any

import pytest
from tests.cli import pictures
from tests.cli.btcpp import refusals
from tests.cli.dot import read_dot
from tests.kit.beacon import BEACON_ID, BRIGHTNESS, LAMP
from tests.kit.golden import Golden
from tests.kit.running_host import RunningHost
from tests.kit.screen import terminal


@pytest.fixture
def shining(daemon: RunningHost) -> Iterator[dict[str, Any]]:
    """The host's tree while it shines for people."""
    daemon.run("goal", "shine", "--wait").ok()
    yield daemon.run("tree", "--json").ok().json
    daemon.run("halt", "--now").ok()
    daemon.until("nothing flows", lambda view: not any(s["flowing"] for s in view["streams"]))


def test_a_kept_step_says_why(shining: dict[str, Any], golden: Golden) -> None:
    (step,) = pictures.steps(shining)
    assert step["schema"] == "test-beacon.shine"
    assert (step["state"], step["component"], step["lasting"]) == ("kept", "beacon", True)
    assert step["arguments"] == {"u": LAMP, "o": BRIGHTNESS, "h": "panther"}
    assert step["needed_by"] == [{"fact": "lit panther", "step": None, "action": None}]
    assert step["locks"] == {"unit": None, "takes": [f"free {BRIGHTNESS}"]}
    golden.check("there is no alternative", step["chosen"]["why"])
    assert step["started"] > 1.7e9
    assert step["ended"] is None


def test_eighty_columns_show_it(
    daemon: RunningHost, shining: dict[str, Any], golden: Golden
) -> None:
    shown = daemon.run("tree", COLUMNS="80").ok().out
    assert "∞ 1 test-beacon.shine  kept since " in shown
    golden.check_line("what a step is done with", shown)
    golden.check_line("what a step is kept for", shown)
    assert max(map(len, shown.splitlines())) <= 80


def test_graphviz_and_groot_can_read_it(daemon: RunningHost, shining: dict[str, Any]) -> None:
    nodes = read_dot(daemon.run("tree", "--graphviz").ok().out).nodes.values()
    assert "1 test-beacon.shine\nkept" in {node["label"] for node in nodes}
    assert refusals(daemon.run("tree", "--groot").ok().out) == []


def test_one_way_of_drawing_at_a_time(daemon: RunningHost, golden: Golden) -> None:
    for wrong in (["--graphviz", "--groot"], ["--watch", "--groot"]):
        daemon.run("tree", *wrong).refused(2, "--groot")
    told = daemon.run("tree", "--graphviz", "--json")
    assert told.code == 2
    golden.check_line("two ways of drawing", told.json["problems"][0]["message"])


def test_watching_prints_a_line_of_json_for_each_change(daemon: RunningHost) -> None:
    with daemon.started("tree", "--watch", "--json") as process:
        assert process.stdout is not None
        assert not pictures.steps(json.loads(process.stdout.readline()))
        daemon.run("goal", "shine").ok()
        states = [step["state"] for step in next(_with_steps(process))]
        assert states == ["running"]
    daemon.run("halt", "--now").ok()


def _with_steps(process: subprocess.Popen[str]) -> Iterator[list[dict[str, Any]]]:
    assert process.stdout is not None
    for line in process.stdout:
        if steps := pictures.steps(json.loads(line)):
            yield steps


def test_watching_on_a_terminal_draws_in_one_place(daemon: RunningHost) -> None:
    with terminal("--control", daemon.control, "tree", "--watch", lines=60) as person:
        person.until("✓ nondum", "sentences told")
        daemon.run("goal", "shine").ok()
        shown = person.until("kept since")
        assert sum("✓ people  —" in line for line in shown) == 1
        assert BEACON_ID not in "\n".join(shown)
    daemon.run("halt", "--now").ok()
