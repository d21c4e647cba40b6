"""The behaviour `localise`, over the host's protocol, with a camera on a port."""

from __future__ import annotations

import itertools
import math
import tomllib
from pathlib import Path
from typing import Any

import pytest
from line_bench import Camera, encoded, events

from nondum.sdk import NondumError

PLUGIN = "nondum_compton_camera.plugin"
LOCALISE = {"u": "gamma-eye", "t": "radiation-source", "h": "robot"}
SOURCE = (0.36, -0.48, 0.8)


def started(worker: Any, camera: Camera, **settings: Any) -> Any:
    return worker(PLUGIN, devices={"list-mode": camera.node}, settings=settings)


def test_it_finds_the_bearing_in_its_own_frame(camera: Camera, worker: Any) -> None:
    plugin = started(worker, camera)
    camera.send(encoded(event) for event in events(SOURCE))
    call = plugin.behave("localise", **LOCALISE).assert_succeeded()
    bearing = plugin.facts["bearing-known", "radiation-source", "robot"]
    assert bearing.header.frame_id == plugin.objects["gamma-eye"]
    assert math.degrees(math.dist(bearing.direction, SOURCE)) < 1.0
    assert math.degrees(bearing.sigma_rad) <= 0.5
    fractions = [fraction for fraction, _ in call.progress]
    assert fractions[-1] == 1.0


def test_noise_on_the_line_changes_nothing(camera: Camera, worker: Any) -> None:
    plugin = started(worker, camera)
    noise = itertools.cycle((b"", b"\xeb\x90\x01", b"\x00\xff\xeb", b"\xeb\x90\x63\xff"))
    pieces = (encoded(e) + n for e, n in zip(events(SOURCE, seed=3), noise, strict=False))
    camera.send(itertools.chain([encoded(next(events(SOURCE)))[11:]], pieces))
    plugin.behave("localise", **LOCALISE).assert_succeeded()
    bearing = plugin.facts["bearing-known", "radiation-source", "robot"]
    assert math.degrees(math.dist(bearing.direction, SOURCE)) < 1.5


def test_a_better_bearing_takes_longer(camera: Camera, worker: Any) -> None:
    plugin = started(worker, camera, accuracy_deg=0.25)
    camera.send((encoded(event) for event in events(SOURCE)), every_s=0.0005)
    plugin.behave("localise", **LOCALISE).assert_succeeded()
    bearing = plugin.facts["bearing-known", "radiation-source", "robot"]
    assert math.degrees(bearing.sigma_rad) <= 0.25


def test_events_of_another_line_are_no_source(camera: Camera, worker: Any) -> None:
    plugin = started(worker, camera, line_kev=1332.5, timeout_s=10.0)
    camera.send(encoded(event) for event in events(SOURCE))
    call = plugin.behave("localise", **LOCALISE).assert_failed("COMPTON_NO_SOURCE")
    assert "0 of them at 1332.5 keV" in call.problem.message
    assert not plugin.facts


def test_a_device_that_speaks_otherwise_is_told(camera: Camera, worker: Any) -> None:
    plugin = started(worker, camera, timeout_s=0.5)
    camera.send(itertools.repeat(b"$GPGGA,123519,4807.038,N*47\r\n"))
    call = plugin.behave("localise", **LOCALISE).assert_failed("COMPTON_SILENT")
    assert "no list-mode frames" in call.problem.message


def test_a_camera_that_is_off_is_told(camera: Camera, worker: Any) -> None:
    plugin = started(worker, camera, timeout_s=0.3)
    plugin.behave("localise", **LOCALISE).assert_failed("COMPTON_SILENT")


def test_a_pulled_camera_is_told(camera: Camera, worker: Any) -> None:
    plugin = started(worker, camera, line_kev=1332.5)
    camera.send(encoded(event) for event in events(SOURCE))
    call = plugin.behave("localise", **LOCALISE)
    camera.unplug()
    call.assert_failed("SERIAL_FAILED")


def test_a_missing_camera_is_told(worker: Any) -> None:
    plugin = worker(PLUGIN)
    plugin.behave("localise", **LOCALISE).assert_failed("DEVICE_MISSING")


def test_halting_frees_the_line(camera: Camera, worker: Any) -> None:
    plugin = started(worker, camera)
    assert plugin.behave("localise", **LOCALISE).halt().state == "halted"
    camera.send(encoded(event) for event in events(SOURCE))
    plugin.behave("localise", **LOCALISE).assert_succeeded()


def test_every_wrong_setting_refuses_the_component(camera: Camera, worker: Any) -> None:
    with pytest.raises(NondumError) as raised:
        started(worker, camera, accuracy_deg=-1, line_kev=True, isotope="Cs-137")
    assert len(raised.value.problems) == 3


def test_what_it_says_of_itself_matches_its_manifest(worker: Any) -> None:
    manifest = tomllib.loads((Path(__file__).parents[1] / "payload.toml").read_text("utf-8"))
    (component,) = manifest["component"]
    described = worker(PLUGIN).description
    assert {device.name: device.match for device in described.devices} == {
        device["name"]: device["match"] for device in component["device"]
    }
    assert [unit.name for unit in described.units] == [u["name"] for u in component["unit"]]
