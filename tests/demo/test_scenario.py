"""Scenarios are random, fair, and the same again from their file."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from demo.emulators.pose import Mount, rotation
from demo.scenario import DISTANCES_M, PARALLAX_RAD, is_decisive, is_fair, random_scenario


@pytest.mark.parametrize("seed", range(30))
def test_every_seed_is_plausible_and_fair(seed: int) -> None:
    scenario = random_scenario(seed)
    for mount in (scenario.camera, scenario.pointer):
        assert math.dist(mount.xyz, (0, 0, 0)) <= 0.3
        assert max(abs(lean) for lean in mount.rpy[:2]) <= math.radians(10)
    low, high = DISTANCES_M
    assert low <= math.dist(scenario.source_m, (0, 0, 0)) <= high
    assert is_fair(scenario.source_m, scenario.camera, scenario.pointer)
    assert is_decisive(scenario.source_m, scenario.camera, scenario.pointer)


def test_seeds_differ_and_repeat() -> None:
    assert random_scenario(1) == random_scenario(1)
    assert random_scenario(1).source_m != random_scenario(2).source_m


def test_a_file_holds_all_of_it(tmp_path: Path) -> None:
    scenario = random_scenario(8)
    scenario.write(tmp_path / "truth.json")
    assert scenario == type(scenario).read(tmp_path / "truth.json")


def test_mounts_far_apart_are_unfair_to_a_near_source() -> None:
    left, right = Mount((0, 1, 0), (0, 0, 0)), Mount((0, -1, 0), (0, 0, 0))
    assert not is_fair((15.0, 0, 0), left, right)
    assert PARALLAX_RAD < 2 / 15


def test_a_source_behind_the_pointer_is_unfair() -> None:
    middle = Mount((0, 0, 0), (0, 0, 0))
    assert not is_fair((-15.0, 0, 0), middle, middle)


@pytest.mark.parametrize("yaws", [(0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])
def test_mounts_that_could_be_left_out_are_not_decisive(yaws: tuple[float, float]) -> None:
    camera, pointer = (Mount((0, 0, 0), (0, 0, yaw)) for yaw in yaws)
    assert not is_decisive((20.0, 0, 0), camera, pointer)


def test_rotation_is_roll_then_pitch_then_yaw() -> None:
    roll, pitch, yaw = 0.1, -0.2, 2.0
    parts = rotation((0, 0, yaw)) @ rotation((0, pitch, 0)) @ rotation((roll, 0, 0))
    assert np.allclose(rotation((roll, pitch, yaw)), parts)


def test_seen_inverts_to_body() -> None:
    mount = Mount((0.1, -0.2, 0.3), (0.1, -0.05, 2.5))
    point = (12.0, -7.0, 1.0)
    assert np.allclose(mount.to_body(mount.seen(point)) + mount.xyz, point)
