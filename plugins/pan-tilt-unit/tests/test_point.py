"""The behaviour `point`, over the host's protocol, on a bench with ports."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import pytest
from ptu_bench import Bench

from nondum.sdk import Bearing, Header, NondumError

PLUGIN = "nondum_pan_tilt_unit.plugin"
POINT = {"u": "laser-pointer", "t": "source", "h": "robot"}
STEP_DEG = 185.1428 / 3600


def bearing(azimuth_deg: float, elevation_deg: float = 0.0) -> Bearing:
    """Seen from the body."""
    return Bearing.from_angles(
        Header(frame_id="robot"),
        azimuth_rad=math.radians(azimuth_deg),
        elevation_rad=math.radians(elevation_deg),
        sigma_rad=0.01,
    )


class Pointer:
    """The plugin at work, and the bench under it."""

    def __init__(self, bench: Bench, worker: Any, **options: Any) -> None:
        devices = {"head": bench.node("head"), "laser-relay": bench.node("relay")}
        mounts = {"laser-pointer": ((0.0, 0.0, 0.3), (0.0, 0.0, 0.0))}
        self.bench = bench
        self.plugin = worker(PLUGIN, **{"devices": devices, "mounts": mounts, **options})

    def know(self, value: Bearing) -> None:
        self.plugin.set_value("bearing-known", "source", "robot", value=value)

    def begin(self) -> Any:
        return self.plugin.behave("point", **POINT)

    def wait(self, is_so: Any) -> None:
        self.bench.wait_until(is_so)


@pytest.fixture
def pointer(bench: Bench, worker: Any) -> Pointer:
    return Pointer(bench, worker)


def test_it_turns_lights_and_is_established(pointer: Pointer) -> None:
    pointer.know(bearing(90, 20))
    pointer.begin().wait_established()
    assert pointer.bench.position == {"P": round(90 / STEP_DEG), "T": round(20 / STEP_DEG)}
    pointer.wait(lambda: pointer.bench.light[-1])  # relays do not answer: it may be on its way


def test_light_comes_after_the_head_has_arrived(pointer: Pointer) -> None:
    pointer.know(bearing(45))
    pointer.begin().wait_established()
    order = pointer.bench.order
    pointer.wait(lambda: "laser on" in order)
    assert order.index("laser on") > order.index(f"PP{round(45 / STEP_DEG)}")
    assert order.index("laser off") < order.index("FT")


@pytest.mark.parametrize("yaw_deg", [0, 30, -120])
def test_the_mount_is_taken_into_account(bench: Bench, worker: Any, yaw_deg: float) -> None:
    mounts = {"laser-pointer": ((0.1, 0.0, 0.3), (0.0, 0.0, math.radians(yaw_deg)))}
    pointer = Pointer(bench, worker, mounts=mounts)
    pointer.know(bearing(10))
    pointer.begin().wait_established()
    assert bench.position["P"] == pytest.approx((10 - yaw_deg) / STEP_DEG, abs=1)


def test_halting_darkens_and_stops(pointer: Pointer) -> None:
    pointer.know(bearing(90))
    call = pointer.begin().wait_established()
    assert call.halt().state == "halted"
    pointer.wait(lambda: pointer.bench.commands[-1] == "H" and not pointer.bench.light[-1])


def test_halting_on_the_way_never_lights(pointer: Pointer) -> None:
    pointer.bench.is_seized = True
    pointer.know(bearing(90))
    call = pointer.begin()
    pointer.wait(lambda: "TP0" in pointer.bench.commands)
    call.halt()
    pointer.wait(lambda: pointer.bench.commands[-1] == "H")
    assert True not in pointer.bench.light


def test_it_follows_a_bearing_that_changes(pointer: Pointer) -> None:
    pointer.know(bearing(10))
    call = pointer.begin().wait_established()
    pointer.know(bearing(-40))
    pointer.wait(lambda: pointer.bench.position["P"] == round(-40 / STEP_DEG))
    pointer.wait(lambda: pointer.bench.light[-3:] == [True, False, True])
    assert not call.has_ended


def test_small_corrections_stay_lit(pointer: Pointer) -> None:
    pointer.know(bearing(10))
    pointer.begin().wait_established()
    pointer.wait(lambda: pointer.bench.light[-1])
    before = list(pointer.bench.light)
    pointer.know(bearing(10.5))
    pointer.wait(lambda: pointer.bench.position["P"] == round(10.5 / STEP_DEG))
    pointer.wait(lambda: pointer.bench.light != before)
    assert False not in pointer.bench.light[len(before) :]


def test_a_head_that_is_pushed_aside_fails_and_darkens(pointer: Pointer) -> None:
    pointer.know(bearing(10))
    call = pointer.begin().wait_established()
    pointer.bench.position["P"] += 40
    call.assert_failed("PTU_MOVED")
    pointer.wait(lambda: not pointer.bench.light[-1])


def test_a_bearing_out_of_reach_fails_before_anything_moves(pointer: Pointer) -> None:
    pointer.know(bearing(178))
    call = pointer.begin().assert_failed("PTU_OUT_OF_REACH")
    assert call.problem.have == "-158.9° to 158.9°"
    assert not any(command.startswith("PP-") for command in pointer.bench.commands)


def test_an_integrators_limits_are_kept(bench: Bench, worker: Any) -> None:
    pointer = Pointer(bench, worker, settings={"tilt_max_deg": 10})
    pointer.know(bearing(0, 15))
    pointer.begin().assert_failed("PTU_OUT_OF_REACH")


def test_an_unknown_bearing_fails(pointer: Pointer) -> None:
    pointer.begin().assert_failed("VALUE_UNKNOWN")


def test_a_bearing_in_an_unknown_frame_fails(pointer: Pointer) -> None:
    pointer.know(Bearing(Header(frame_id="elsewhere"), (1.0, 0.0, 0.0), 0.01))
    pointer.begin().assert_failed("FRAME_UNKNOWN")


@pytest.mark.parametrize("missing", ["head", "laser-relay"])
def test_a_missing_device_fails(pointer: Pointer, missing: str) -> None:
    pointer.plugin.detach(missing)
    pointer.know(bearing(0))
    call = pointer.begin().assert_failed("DEVICE_MISSING")
    assert missing in call.problem.message


def test_a_pulled_relay_or_head_fails(pointer: Pointer) -> None:
    pointer.know(bearing(10))
    call = pointer.begin().wait_established()
    pointer.bench.unplug()
    call.assert_failed("SERIAL_FAILED")


def test_starting_darkens_what_was_left_lit(pointer: Pointer) -> None:
    pointer.wait(lambda: pointer.bench.light == [False])


def test_wrong_settings_refuse_the_component(bench: Bench, worker: Any) -> None:
    with pytest.raises(NondumError, match="SETTING_INVALID"):
        Pointer(bench, worker, settings={"spead_deg_s": 1})


def test_what_it_says_of_itself_matches_its_manifest(pointer: Pointer) -> None:
    manifest = tomllib.loads((Path(__file__).parents[1] / "payload.toml").read_text("utf-8"))
    (component,) = manifest["component"]
    described = pointer.plugin.description
    assert {device.name: device.match for device in described.devices} == {
        device["name"]: device["match"] for device in component["device"]
    }
    assert [unit.name for unit in described.units] == [u["name"] for u in component["unit"]]
