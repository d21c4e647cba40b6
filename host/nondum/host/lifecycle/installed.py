"""Initial components: payloads that an integrator installs for good, before anything is plugged in.

An installed payload is one on a drive that is never pulled; only `uninstall` takes it out.
"""

from __future__ import annotations

import asyncio
from pathlib import Path

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.catalogue.records import INSTALLED, PayloadRecord, Step
from nondum.host.events import DriveInserted, DriveRemoved
from nondum.host.lifecycle.bus import Bus
from nondum.sdk.errors import PayloadRefused, Problem

_SETTLED = frozenset({Step.ACTIVE, Step.REFUSED, Step.QUARANTINED})


async def install(folder: Path, catalogue: Catalogue, bus: Bus) -> PayloadRecord:
    """Install a payload folder (an absolute path) and wait until it is active.

    Raises `PayloadRefused` with what is wrong with it; then nothing of it stays.
    """
    drive = _drive(folder.name)
    if drive in catalogue.state.drives:
        fix = f"`nondum payload uninstall {folder.name}` first"
        problem = Problem("ALREADY_PRESENT", "is installed already", where=folder.name, fix=fix)
        raise PayloadRefused(problem)
    with_drive = _Watch(catalogue, bus, drive)
    bus.emit(DriveInserted(drive, folder, INSTALLED))
    try:
        payload = await with_drive.settled()
    except BaseException:
        bus.emit(DriveRemoved(drive))
        raise
    finally:
        with_drive.close()
    return payload


async def uninstall(payload_id: str, catalogue: Catalogue, bus: Bus) -> None:
    """Remove an installed payload and wait until nothing of it is left.

    Raises `PayloadRefused` (NOT_INSTALLED).
    """
    drive = _drive(payload_id)
    if drive not in catalogue.state.drives:
        raise PayloadRefused(Problem("NOT_INSTALLED", "is not installed", where=payload_id))
    watch = _Watch(catalogue, bus, drive)
    keys = {p.key for p in catalogue.state.payloads.values() if set(p.sources) == {drive}}
    bus.emit(DriveRemoved(drive))
    try:
        await watch.until_gone(keys)
    finally:
        watch.close()


def _drive(payload_id: str) -> str:
    return f"{INSTALLED}/{payload_id}"


class _Watch:
    """Waits for the catalogue to say something of one drive."""

    def __init__(self, catalogue: Catalogue, bus: Bus, drive: str) -> None:
        self._catalogue, self._drive = catalogue, drive
        self._changed = asyncio.Event()
        self.close = bus.subscribe(lambda event: self._changed.set())

    async def settled(self) -> PayloadRecord:
        """The drive's payload, once it is active. Raises `PayloadRefused`."""
        while True:
            state = self._catalogue.state
            drive = state.drives.get(self._drive)
            if drive is not None and drive.problems:
                raise PayloadRefused(*drive.problems)
            for payload in state.payloads.values():
                if self._drive in payload.sources and payload.step in _SETTLED:
                    if payload.problems:
                        raise PayloadRefused(*payload.problems)
                    return payload
            await self._wait()

    async def until_gone(self, keys: set[str]) -> None:
        """Wait until none of these payloads is left."""
        while keys & self._catalogue.state.payloads.keys():
            await self._wait()

    async def _wait(self) -> None:
        await self._changed.wait()
        self._changed.clear()
