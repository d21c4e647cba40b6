"""The machine's own devices, whatever they are here."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Any

import pytest

from nondum.host.core.events.devices import DeviceAppeared, DeviceRemoved
from nondum.host.core.events.event import Event
from nondum.host.sources.devices import UdevSource
from nondum.host.sources.devices.hardware import device_id, devices, physical
from nondum.host.sources.devices.source import Sightings
from nondum.host.sources.devices.udev import Tree, _looked_at, _present
from nondum.host.sources.uevents import UDEV_RUNS

pytestmark = pytest.mark.anyio


class Device:
    """What pyudev would give of something that hangs on nothing."""

    sys_path = "/nowhere"
    device_type = None
    parent = None

    def __init__(self, path: str, action: str | None, subsystem: str = "tty", **properties: str):
        self.device_path, self.action, self.subsystem = path, action, subsystem
        self.device_node = properties.get("DEVNAME")
        self.properties = {**properties, "SEQNUM": "7"}


def told_of(*heard: Any) -> list[Event]:
    """What is told of messages that come one by one."""
    told: list[Event] = []
    tree = Tree(Sightings(told.append))
    for device in heard:
        tree.see(_looked_at([device]))
    return told


def have_told(device: str, action: str) -> None:
    """Have the kernel tell of a device once more (`uevent` in sysfs)."""
    Path(f"/sys{device}/uevent").write_text(action)


PORT = "/devices/pci0/usb1/1-1/ttyUSB0/tty/ttyUSB0"


async def test_only_real_devices_with_nodes_are_told() -> None:
    expected = len(devices(_present()))
    told: asyncio.Queue[Event] = asyncio.Queue()
    task = asyncio.create_task(UdevSource().watch(told.put_nowait))
    try:
        for _ in range(expected):
            event = await asyncio.wait_for(told.get(), 60)
            assert isinstance(event, DeviceAppeared)
            assert all(node.subsystem != "block" for node in event.found.nodes)
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@pytest.mark.skipif(os.getuid() != 0, reason="only root makes the kernel tell of a device")
@pytest.mark.skipif(UDEV_RUNS.exists(), reason="udevd would act on what the test says")
async def test_kernel_tells_of_removal_and_return() -> None:
    parts = [part for part in _present() if part.node]
    ids = [device_id(physical(part)) for part in parts]
    alone = next((part for part, id in zip(parts, ids, strict=True) if ids.count(id) == 1), None)
    if alone is None:
        pytest.skip("this machine has no device of one node on a bus")
    device = device_id(physical(alone))
    told: asyncio.Queue[Event] = asyncio.Queue()
    task = asyncio.create_task(UdevSource().watch(told.put_nowait))
    try:
        while getattr(await asyncio.wait_for(told.get(), 60), "device", "") != device:
            pass
        for action, kind in (("remove", DeviceRemoved), ("add", DeviceAppeared)):
            have_told(alone.path, action)
            while (event := await asyncio.wait_for(told.get(), 60)).to_dict()["device"] != device:
                pass
            assert type(event) is kind
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def test_device_appears_once_and_goes() -> None:
    told = told_of(
        Device(PORT, "add", DEVNAME="/dev/ttyUSB0", ID_MODEL="a"),
        Device(PORT, "bind", DEVNAME="/dev/ttyUSB0", ID_MODEL="a"),
        Device(PORT, "remove", DEVNAME="/dev/ttyUSB0"),
        Device(PORT, "remove", DEVNAME="/dev/ttyUSB0"),
    )
    assert [type(event) for event in told] == [DeviceAppeared, DeviceRemoved]
    (found,) = (event.found for event in told if isinstance(event, DeviceAppeared))
    (node,) = found.nodes
    assert node.properties == {"DEVNAME": "/dev/ttyUSB0", "ID_MODEL": "a"}


async def test_terminals_and_drives_are_left_alone() -> None:
    assert not told_of(
        Device("/devices/virtual/tty/tty1", "add", DEVNAME="/dev/tty1"),
        Device("/devices/pci0/usb1/1-2/block/sda", "add", "block", DEVNAME="/dev/sda"),
        Device("/devices/pci0/usb1/1-2", "add", "usb"),
    )
