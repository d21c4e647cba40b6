"""The demonstration as people run it: one command, every stage reached, or a non-zero exit."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LIMIT_S = 600
STAGES = ["I", "pulled", "put back", "offered", "killed", "II", "III"]

pytestmark = [pytest.mark.daemon, pytest.mark.alone, pytest.mark.timeout(LIMIT_S)]


def demonstrate(*options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "demo", "--json", *options],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )


@pytest.mark.parametrize("options", [(), ("--shuffle", "11")], ids=["as shipped", "shuffled"])
def test_every_stage_reaches_its_goal(options: tuple[str, ...]) -> None:
    done = demonstrate(*options)
    assert done.returncode == 0, done.stdout + done.stderr
    document = json.loads(done.stdout)
    assert document["reached"] is True
    assert [stage["name"] for stage in document["stages"]] == STAGES
    for stage in document["stages"]:
        installing = ("seen", "verified", "installed", "ready")
        phases = [stage["phases_s"][p] for p in installing if p in stage["phases_s"]]
        assert phases == sorted(phases)
        assert len(phases) == (0 if stage["name"] in ("pulled", "killed") else len(installing))
        assert stage["plan"]
        assert "BUT" not in stage["measure"]


@pytest.mark.parametrize(("turned_degrees", "is_reached"), [("45", False), ("0", True)])
def test_a_wrong_mount_fails_the_demonstration(turned_degrees: str, is_reached: bool) -> None:
    """The operator tells a mount turned by half a right angle: drivers and host cannot know."""
    done = demonstrate("--only", "III", "--wrong-mount", turned_degrees, "--seed", "1")
    assert done.returncode == (0 if is_reached else 1), done.stdout + done.stderr
    reached = {stage["name"]: stage["reached"] for stage in json.loads(done.stdout)["stages"]}
    assert reached == {"III": is_reached}
