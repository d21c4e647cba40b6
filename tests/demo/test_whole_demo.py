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


def assert_reached(done: subprocess.CompletedProcess[str], stages: list[str]) -> None:
    """All these stages, and no others, were reached in their order."""
    assert done.returncode == 0, done.stdout + done.stderr
    document = json.loads(done.stdout)
    assert document["reached"] is True
    assert [stage["name"] for stage in document["stages"]] == stages
    for stage in document["stages"]:
        installing = ("seen", "verified", "installed", "ready")
        phases = [stage["phases_s"][p] for p in installing if p in stage["phases_s"]]
        assert phases == sorted(phases)
        assert len(phases) == (0 if stage["name"] in ("pulled", "killed") else len(installing))
        assert stage["plan"]
        assert "BUT" not in stage["measure"]


def test_every_stage_reaches_its_goal(seed: int) -> None:
    assert_reached(demonstrate("--seed", str(seed)), STAGES)


def test_pointing_needs_no_name_of_ours(seed: int) -> None:
    """Every name of the plugins is another one."""
    options = ("--shuffle", "11", "--only", "III", "--seed", str(seed))
    assert_reached(demonstrate(*options), ["III"])


@pytest.mark.long("demonstrations")
def test_every_stage_is_reached_with_other_names(seed: int) -> None:
    assert_reached(demonstrate("--shuffle", str(seed), "--seed", str(seed)), STAGES)


@pytest.mark.long("demonstrations")
def test_pointing_alone_reaches_its_goal(seed: int) -> None:
    assert_reached(demonstrate("--only", "III", "--seed", str(seed)), ["III"])


@pytest.mark.long("demonstrations")
@pytest.mark.parametrize("options", [("--planner", "pyperplan"), ("--install", "pip")])
def test_promised_packages_can_carry_the_whole_way(options: tuple[str, ...], seed: int) -> None:
    """pyperplan as the only planner; pip as what installs."""
    chosen = ("--only", "I", "--only", "III", *options)
    assert_reached(demonstrate(*chosen, "--seed", str(seed)), ["I", "III"])


def test_planner_that_is_not_installed_is_refused() -> None:
    done = demonstrate("--only", "III", "--planner", "no-such")
    assert done.returncode != 0
    assert "CONFIG_PLANNER" in done.stdout + done.stderr


def test_a_wrong_mount_fails_the_demonstration() -> None:
    """The operator tells a mount turned by half a right angle: drivers and host cannot know."""
    done = demonstrate("--only", "III", "--wrong-mount", "45", "--seed", "1")
    assert done.returncode == 1, done.stdout + done.stderr
    reached = {stage["name"]: stage["reached"] for stage in json.loads(done.stdout)["stages"]}
    assert reached == {"III": False}
