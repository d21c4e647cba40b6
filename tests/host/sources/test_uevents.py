"""Messages of devices: as they come, and when too many come."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path

import pytest
import pyudev

from nondum.host.sources.uevents import UDEV_RUNS, uevents

pytestmark = [
    pytest.mark.anyio,
    pytest.mark.skipif(os.getuid() != 0, reason="only root makes the kernel tell of a device"),
    pytest.mark.skipif(UDEV_RUNS.exists(), reason="udevd would act on what the test says"),
]

NULL = "/devices/virtual/mem/null"


def have_told() -> None:
    """Have the kernel tell of /dev/null once more (`uevent` in sysfs)."""
    Path(f"/sys{NULL}/uevent").write_text("change")


async def test_messages_come_as_devices() -> None:
    with uevents(pyudev.Context(), "mem") as messages:
        have_told()
        devices = await asyncio.wait_for(messages.next(), 60)
        assert devices is not None
        assert [device.device_path for device in devices] == [NULL]


async def test_lost_messages_are_told_and_later_ones_come(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    start = pyudev.Monitor.start

    def start_with_a_small_buffer(monitor: pyudev.Monitor) -> None:
        start(monitor)
        monitor.set_receive_buffer_size(4096)

    monkeypatch.setattr(pyudev.Monitor, "start", start_with_a_small_buffer)
    with uevents(pyudev.Context(), "mem") as messages:
        for _ in range(300):  # nothing is read meanwhile
            have_told()
        assert await asyncio.wait_for(messages.next(), 60) is None
        async with asyncio.timeout(60):
            have_told()
            while not await messages.next():
                have_told()
