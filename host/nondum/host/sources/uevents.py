"""What udev (or, without it, the kernel) tells of devices, on the loop (udev(7), netlink(7))."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pyudev

UDEV_RUNS = Path("/run/udev/control")

log = logging.getLogger(__name__)


def udev_runs() -> bool:
    """Whether udevd is there to tell of devices; the kernel's own messages say less."""
    return UDEV_RUNS.exists()


class Uevents:
    """Messages as they come. Made by `uevents`."""

    def __init__(self, monitor: pyudev.Monitor, ready: asyncio.Event) -> None:
        self._monitor, self._ready = monitor, ready

    async def next(self) -> list[pyudev.Device] | None:
        """Wait for messages; all that are there then.

        None when more came than the kernel keeps: look at every device again.
        """
        await self._ready.wait()
        self._ready.clear()
        try:
            return list(iter(lambda: self._monitor.poll(timeout=0), None))
        except OSError as error:
            log.warning("messages of devices were lost: %s", error)
            _clear_error(self._monitor.fileno())
            return None


@contextmanager
def uevents(context: pyudev.Context, subsystem: str | None = None) -> Iterator[Uevents]:
    """Listen, from now on, for as long as the context lasts."""
    monitor = pyudev.Monitor.from_netlink(context, "udev" if udev_runs() else "kernel")
    if subsystem is not None:
        monitor.filter_by(subsystem)
    monitor.start()
    ready, loop = asyncio.Event(), asyncio.get_running_loop()
    loop.add_reader(monitor.fileno(), ready.set)
    try:
        yield Uevents(monitor, ready)
    finally:
        loop.remove_reader(monitor.fileno())


def _clear_error(descriptor: int) -> None:
    """Take the pending error from the socket: until then it cannot be polled (socket(7))."""
    with socket.socket(fileno=os.dup(descriptor)) as double:
        double.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
