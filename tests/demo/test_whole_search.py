"""The demonstration of three hosts as people run it: one command, all stages, or a failure."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

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


@pytest.mark.alone
@pytest.mark.parametrize("options", [(), ("--loopback",)], ids=["as shipped", "loopback"])
def test_two_robots_search_with_the_node_and_miss_it(options: tuple[str, ...]) -> None:
    done = search(*options)
    assert done.returncode == 0, done.stdout + done.stderr
    document = json.loads(done.stdout)
    has_network = "namespaces" in document["where"]
    assert has_network == (os.geteuid() == 0 and not options)
    assert document["reached"] is True
    assert [stage["name"] for stage in document["stages"]] == STAGES
    panther, scout, steered, lost = document["stages"]
    for stage in (panther, scout):
        phases = [stage["phases_s"][phase] for phase in IN_ORDER]
        assert phases == sorted(phases)
        steps = [step.partition(" ")[0] for step in stage["plan"]]
        assert [step.partition(".")[2] for step in steps] == ["stream", "detect", "watch", "report"]
        assert f"thermal-camera@{stage['name']}" in stage["measure"]
        for component in ("people-detector", "visual-tracker", "speaker"):
            assert f"{component}@node" in stage["measure"]
    assert "mobile-base.drive" in steered["plan"][-1]
    assert "visual-tracker.track node__" in steered["plan"][-2]
    assert lost["phases_s"].keys() == {"halted", "told"}
    assert "bring the host node back" in lost["measure"]
    assert all("BUT" not in stage["measure"] for stage in document["stages"])


def test_without_the_speaker_nothing_is_reached() -> None:
    done = search("--without", "speaker")
    assert done.returncode == 1, done.stdout + done.stderr
    assert json.loads(done.stdout)["reached"] is False
    assert "does not say that it can" in done.stderr
