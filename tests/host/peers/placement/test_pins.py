"""Where people want payloads to run is kept."""

from __future__ import annotations

from pathlib import Path

import pytest

from nondum.host.peers.placement.pins import Pins
from nondum.sdk.errors import InstallFailed

pytestmark = pytest.mark.anyio

LIGHT, EYE = "org.example.light", "org.example.eye"


async def test_pins_outlive_the_daemon(tmp_path: Path) -> None:
    pins = await Pins.open(tmp_path / "places.json")
    await pins.put(LIGHT, "mule")
    await pins.put(EYE, "tower")
    await pins.put(LIGHT, "tower")
    await pins.drop(EYE)
    assert pins.hosts == {LIGHT: "tower"}
    assert (await Pins.open(tmp_path / "places.json")).hosts == {LIGHT: "tower"}


@pytest.mark.parametrize("text", ["", "{", "[1]", '{"org.example.light": 7}', "\udcff"])
async def test_file_that_says_nothing_pins_nothing(tmp_path: Path, text: str) -> None:
    (tmp_path / "places.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    assert (await Pins.open(tmp_path / "places.json")).hosts == {}


async def test_what_cannot_be_kept_is_refused_and_does_not_hold(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file, not a folder")
    pins = await Pins.open(tmp_path / "state" / "places.json")
    with pytest.raises(InstallFailed) as refused:
        await pins.put(LIGHT, "mule")
    assert refused.value.code == "IO_ERROR"
    assert pins.hosts == {}
