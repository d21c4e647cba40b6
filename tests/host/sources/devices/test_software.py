"""Which payloads have the software for a device that no component uses."""

from __future__ import annotations

import asyncio

import pytest
from tests.host.sources.devices.sightings import appeared, camera_with_microphone, serial_adapter

from nondum.host.core.events.devices import DeviceRemoved
from nondum.host.core.records.device import DeviceRecord
from nondum.host.core.records.payload import FormerPayload
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.sources.devices.drivers import drivers_of, missed, remembered
from nondum.host.sources.devices.hardware import record
from nondum.host.sources.devices.software import Software
from nondum.sdk.description import DeviceNeed, PluginDescription

LINE = record(serial_adapter(ID_MODEL="Gauge"))
CAMERA = record(camera_with_microphone())


def former(name: str, **match: str) -> FormerPayload:
    needs = (DeviceNeed("port", match),)
    described = {name: PluginDescription(name, "1.0", devices=needs)}
    return FormerPayload(f"org.example.{name}", "1.0", described, 1.0e9, 10)


GAUGE = former("gauge", usb="0403:6001")
ANY_LINE = former("terminal", subsystem="tty")


def known(*payloads: FormerPayload, devices: tuple[DeviceRecord, ...] = ()) -> Snapshot:
    return Snapshot("spot", 1, former=payloads, devices=devices)


def test_payload_that_was_here_is_named() -> None:
    assert LINE is not None and CAMERA is not None
    (told,) = missed([LINE, CAMERA], remembered(known(GAUGE)))
    assert told.startswith(
        "nothing here drives Gauge (usb:1-4): org.example.gauge 1.0 (here until 2001-09-09"
    )


def test_who_asks_by_id_comes_before_who_asks_by_kind() -> None:
    assert LINE is not None
    found = drivers_of(LINE, remembered(known(ANY_LINE, GAUGE)))
    assert [driver.component for driver in found] == ["gauge"]
    found = drivers_of(LINE, remembered(known(ANY_LINE)))
    assert [driver.component for driver in found] == ["terminal"]


@pytest.mark.anyio
async def test_device_that_has_gone_again_is_not_told() -> None:
    told: asyncio.Queue[str] = asyncio.Queue()
    assert LINE is not None
    gone = appeared("pulled", "/dev/ttyUSB7", ID_VENDOR_ID="0403", ID_MODEL_ID="6001")
    snapshot = known(GAUGE, devices=(LINE,))
    software = Software(lambda: snapshot, told.put_nowait, patience_s=0.0)
    software.on_event(gone)
    software.on_event(DeviceRemoved("pulled"))
    software.on_event(type(gone)(LINE.id, LINE))
    task = asyncio.create_task(software.run())
    try:
        assert "(usb:1-4)" in await asyncio.wait_for(told.get(), 60)
        assert told.empty()
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
