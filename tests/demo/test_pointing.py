"""The scorer passes only a lit laser that was held on the source, and is fooled by nothing else."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from demo.emulators.pose import Floats, Mount, rotation
from demo.pointing import HELD_S, Truth, off_source_rad, read_log, score
from demo.scenario import Scenario, random_scenario

SEEDS = range(20)


def aimed(scenario: Scenario, *, assumed: Mount | None = None, off_deg: float = 0.0) -> Truth:
    """A head turned to the source as it would be if its mount were `assumed` (the true one)."""
    x, y, z = (assumed or scenario.pointer).seen(scenario.source_m)
    tilt = math.atan2(z, math.hypot(x, y)) + math.radians(off_deg)
    return Truth(at_s=100.0, pan_rad=math.atan2(y, x), tilt_rad=tilt, laser=True)


def held(truth: Truth, seconds: float = 2.0) -> list[Truth]:
    """The same truth, ten times a second, up to its moment."""
    count = round(seconds * 10)
    return [replace(truth, at_s=truth.at_s - n / 10) for n in reversed(range(count))]


@pytest.mark.parametrize("seed", SEEDS)
def test_an_exact_aim_is_reached(seed: int) -> None:
    scenario = random_scenario(seed)
    found = score(scenario, held(aimed(scenario)))
    assert found.is_reached
    assert found.angle_rad < 1e-6


@pytest.mark.parametrize(("off_deg", "reached"), [(2.9, True), (3.1, False), (-3.1, False)])
def test_three_degrees_are_the_limit(off_deg: float, *, reached: bool) -> None:
    scenario = random_scenario(3)
    assert score(scenario, held(aimed(scenario, off_deg=off_deg))).is_reached is reached


@pytest.mark.parametrize("seed", SEEDS)
def test_a_wrong_mount_fails(seed: int) -> None:
    """A fifth of a radian of yaw is enough, and so is no mount at all."""
    scenario = random_scenario(seed)
    roll, pitch, yaw = scenario.pointer.rpy
    for wrong in (
        Mount(scenario.pointer.xyz, (roll, pitch, yaw + 0.2)),
        Mount((0, 0, 0), (0, 0, 0)),
    ):
        assert not score(scenario, held(aimed(scenario, assumed=wrong))).is_reached


@pytest.mark.parametrize("seed", SEEDS)
def test_a_frozen_head_fails(seed: int) -> None:
    scenario = random_scenario(seed)
    frozen = replace(aimed(scenario), pan_rad=scenario.pan_rad, tilt_rad=scenario.tilt_rad)
    assert not score(scenario, held(frozen)).is_reached


def test_an_inverted_head_fails() -> None:
    scenario = random_scenario(2)
    right = aimed(scenario)
    wrong = replace(right, pan_rad=-right.pan_rad, tilt_rad=-right.tilt_rad)
    assert not score(scenario, held(wrong)).is_reached


def test_a_dark_laser_fails() -> None:
    scenario = random_scenario(2)
    found = score(scenario, held(replace(aimed(scenario), laser=False)))
    assert not found.is_reached
    assert str(found) == "laser off, 0.00° from the source"


def test_a_flash_on_the_way_past_fails() -> None:
    scenario = random_scenario(2)
    truths = held(aimed(scenario))
    truths[-5] = replace(truths[-5], laser=False)
    assert not score(scenario, truths).is_reached
    truths[-5] = replace(truths[-5], laser=True, pan_rad=truths[-5].pan_rad + 0.2)
    assert not score(scenario, truths).is_reached


def test_only_the_last_second_is_judged() -> None:
    scenario = random_scenario(2)
    truths = held(aimed(scenario), seconds=4.0)
    before = [replace(t, laser=False) if t.at_s < 100 - HELD_S - 0.15 else t for t in truths]
    assert score(scenario, before).is_reached


def test_what_comes_after_the_end_is_not_judged() -> None:
    scenario = random_scenario(2)
    after = replace(aimed(scenario), at_s=101.0, laser=False)
    assert score(scenario, [*held(aimed(scenario)), after], end_s=100.5).is_reached


@pytest.mark.parametrize("end_s", [None, 50.0, 200.0], ids=["empty", "before", "long after"])
def test_no_log_of_that_time_is_no_success(end_s: float | None) -> None:
    scenario = random_scenario(2)
    truths = held(aimed(scenario)) if end_s else []
    found = score(scenario, truths, end_s=end_s)
    assert not found.is_reached
    assert found.angle_rad == math.pi


def test_the_angle_is_that_between_ray_and_source() -> None:
    """Computed another way: the ray in the body frame, by matrices."""
    scenario = random_scenario(4)
    truth = Truth(0.0, 0.4, -0.3, laser=True)
    ahead = rotation((0.0, 0.3, 0.4)) @ np.array((1.0, 0.0, 0.0))
    ray: Floats = rotation(scenario.pointer.rpy) @ ahead
    way = np.asarray(scenario.source_m) - np.asarray(scenario.pointer.xyz)
    expected = math.acos(float(ray @ way) / float(np.linalg.norm(way)))
    assert off_source_rad(scenario, truth) == pytest.approx(expected)


def test_a_log_cut_short_is_read_up_to_there(tmp_path: Path) -> None:
    truth = Truth(1.0, 0.1, 0.2, laser=True)
    line = json.dumps({"at_s": 1.0, "pan_rad": 0.1, "tilt_rad": 0.2, "laser": True})
    (tmp_path / "log").write_text(f"{line}\n{line}\n{line[:20]}", encoding="utf-8")
    assert read_log(tmp_path / "log") == [truth, truth]
