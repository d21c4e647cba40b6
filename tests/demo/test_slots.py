"""Device slot files say what udev would."""

from __future__ import annotations

import fnmatch
import tomllib
from pathlib import Path
from typing import Any

import pytest
from demo import slots

ROOT = Path(__file__).parents[2]


def test_a_plugged_device_is_one_whole_file(tmp_path: Path) -> None:
    file = slots.plug(tmp_path, "head", "/dev/pts/7", slots.PAN_TILT_UNIT)
    read = tomllib.loads(file.read_text(encoding="utf-8"))
    assert read == {"device": {"node": "/dev/pts/7", "properties": slots.PAN_TILT_UNIT}}
    assert list(tmp_path.iterdir()) == [file]


def test_an_unplugged_one_is_gone(tmp_path: Path) -> None:
    slots.plug(tmp_path, "head", "/dev/pts/7", slots.PAN_TILT_UNIT)
    slots.unplug(tmp_path, "head")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("plugin", "need", "properties"),
    [
        ("compton-camera", "list-mode", slots.COMPTON_CAMERA),
        ("pan-tilt-unit", "head", slots.PAN_TILT_UNIT),
        ("pan-tilt-unit", "laser-relay", slots.LASER_RELAY),
    ],
)
def test_each_device_meets_its_need_and_no_other(
    plugin: str, need: str, properties: dict[str, str]
) -> None:
    matched = [
        (folder, device["name"])
        for folder in ("compton-camera", "pan-tilt-unit")
        for device in needs(folder)
        if all(
            fnmatch.fnmatchcase(properties.get(key, ""), pattern)
            for key, pattern in device["match"].items()
        )
    ]
    assert matched == [(plugin, need)]


def needs(plugin: str) -> list[dict[str, Any]]:
    manifest = tomllib.loads((ROOT / "plugins" / plugin / "payload.toml").read_text("utf-8"))
    return [device for part in manifest["component"] for device in part.get("device", [])]
