"""The demonstration of three hosts as people run it: one command, all stages, or a failure."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
LIMIT_S = 400
STAGES = ["panther", "scout", "steered", "node lost"]
IN_ORDER = ("found", "payloads in", "understood", "in plan", "alert")

pytestmark = [pytest.mark.daemon, pytest.mark.timeout(LIMIT_S)]


def search(*options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "demo", "search", "--json", *options],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )


def found_by(done: subprocess.CompletedProcess[str], stages: list[str]) -> Sequence[Any]:
    """The stages of a demonstration that has reached these, in their order."""
    assert done.returncode == 0, done.stdout + done.stderr
    document = json.loads(done.stdout)
    assert document["reached"] is True
    assert [stage["name"] for stage in document["stages"]] == stages
    assert all("BUT" not in stage["measure"] for stage in document["stages"])
    found: Sequence[Any] = document["stages"]
    return found


def assert_searched(stage: Any) -> None:
    """A robot searched with the parts of the node."""
    phases = [stage["phases_s"][phase] for phase in IN_ORDER]
    assert phases == sorted(phases)
    steps = [step.partition(" ")[0] for step in stage["plan"]]
    assert [step.partition(".")[2] for step in steps] == ["stream", "detect", "watch", "report"]
    assert f"thermal-camera@{stage['name']}" in stage["measure"]
    for component in ("people-detector", "visual-tracker", "speaker"):
        assert f"{component}@node" in stage["measure"]


@pytest.mark.alone
@pytest.mark.parametrize(
    "options",
    [
        pytest.param((), id="as shipped"),
        pytest.param(("--loopback",), id="loopback", marks=pytest.mark.long("demonstrations")),
    ],
)
def test_two_robots_search_with_the_node_and_miss_it(options: tuple[str, ...]) -> None:
    done = search(*options)
    panther, scout, steered, lost = found_by(done, STAGES)
    has_network = "namespaces" in json.loads(done.stdout)["where"]
    assert has_network == (os.geteuid() == 0 and not options)
    assert_searched(panther)
    assert_searched(scout)
    assert "mobile-base.drive" in steered["plan"][-1]
    assert "visual-tracker.track node__" in steered["plan"][-2]
    assert lost["phases_s"].keys() == {"halted", "told"}
    assert "bring the host node back" in lost["measure"]


@pytest.mark.alone
def test_robot_searches_with_the_node_on_loopback() -> None:
    done = search("--loopback", "--only", "panther")
    (panther,) = found_by(done, ["panther"])
    assert "namespaces" not in json.loads(done.stdout)["where"]
    assert_searched(panther)


def test_without_the_speaker_nothing_is_reached() -> None:
    done = search("--without", "speaker")
    assert done.returncode == 1, done.stdout + done.stderr
    assert json.loads(done.stdout)["reached"] is False
    assert "does not say that it can" in done.stderr
