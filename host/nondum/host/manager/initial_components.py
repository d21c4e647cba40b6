"""Initial components: payloads that an integrator installs for good, before anything is plugged in.

An installed payload is one on a drive that is never pulled; only `uninstall` takes it out. A newer
release that is installed takes over like any other; the one before it is kept, to go back to, until
the next one.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.core.bus import Bus
from nondum.host.core.events.drives import DriveInserted, DriveRemoved
from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.records.drive import INSTALLED
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle import releases
from nondum.host.manager.watch import Watch
from nondum.sdk.errors import PayloadRefused, Problem


async def install(folder: Path, catalogue: Catalogue, bus: Bus) -> PayloadRecord:
    """Install a payload folder (an absolute path) and wait until it is active, or waits behind a
    newer release.

    Raises `PayloadRefused` with what is wrong with it; then nothing of it stays.
    """
    drive = _free_drive(catalogue.state, folder.name)
    with Watch(catalogue, bus) as watch:
        bus.emit(DriveInserted(drive, folder, INSTALLED))
        try:
            found = await watch.until(lambda state: _found(state, drive))
            if len(_installed_as(catalogue.state, found)) == 1:
                payload = await watch.until(lambda state: _settled(state, found.key))
                _drop_older(catalogue.state, payload, bus)
                return payload
            _go_forward(catalogue.state, found, bus)
            group = found.payload_id
            await watch.until(lambda state: group not in state.rollbacks or None)
        except BaseException:
            bus.emit(DriveRemoved(drive))
            raise
        bus.emit(DriveRemoved(drive))
        return await watch.until(lambda state: _settled(state, found.key))


async def uninstall(payload_id: str, catalogue: Catalogue, bus: Bus) -> None:
    """Remove an installed payload, all its releases, and wait until nothing of it is left.

    Raises `PayloadRefused` (NOT_INSTALLED).
    """
    state = catalogue.state
    drives = set(_drives(state, payload_id))
    if not drives:
        fix = "see `nondum status` for what is here, and from which drive"
        raise PayloadRefused(Problem("NOT_INSTALLED", "is not installed", payload_id, fix=fix))
    gone = [p for p in state.payloads.values() if p.sources and set(p.sources) <= drives]
    in_order = sorted(gone, key=lambda p: p.step is Step.ACTIVE)  # none is to come back for a while
    ordered = dict.fromkeys(drive for payload in in_order for drive in payload.sources)
    with Watch(catalogue, bus) as watch:
        for drive in (*ordered, *(drives - ordered.keys())):
            bus.emit(DriveRemoved(drive))
        keys = {payload.key for payload in gone}
        await watch.until(lambda state: not keys & state.payloads.keys() or None)


def _drives(state: HostState, payload_id: str) -> Iterator[str]:
    """The drives that stand for releases of a payload."""
    name = f"{INSTALLED}/{payload_id}"
    return (id for id in state.drives if id == name or id.startswith(f"{name}/"))


def _free_drive(state: HostState, payload_id: str) -> str:
    name = f"{INSTALLED}/{payload_id}"
    names = itertools.chain((name,), (f"{name}/{number}" for number in itertools.count(2)))
    return next(one for one in names if one not in state.drives)


def _found(state: HostState, drive: str) -> PayloadRecord | None:
    """The payload on a drive, once it was read. Raises `PayloadRefused`."""
    read = state.drives.get(drive)
    if read is not None and read.problems:
        raise PayloadRefused(*read.problems)
    return next((p for p in state.payloads.values() if drive in p.sources), None)


def _installed_as(state: HostState, payload: PayloadRecord) -> list[str]:
    kinds = {name: state.drives[name].kind for name in payload.sources if name in state.drives}
    return [name for name, kind in kinds.items() if kind == INSTALLED]


def _settled(state: HostState, key: str) -> PayloadRecord | None:
    """A payload that has come to its end. Raises `PayloadRefused`."""
    payload = state.payloads.get(key)
    if payload is None:
        return None
    if payload.step in (Step.REFUSED, Step.QUARANTINED):
        raise PayloadRefused(*payload.problems)
    other = releases.waits_behind(state, payload)
    is_behind = payload.step is Step.SUPERSEDED and other is not None and other.step is Step.ACTIVE
    return payload if is_behind or payload.step is Step.ACTIVE else None


def _go_forward(state: HostState, payload: PayloadRecord, bus: Bus) -> None:
    """Install again what a person had gone back from. Raises `PayloadRefused`."""
    if payload.payload_id in state.rollbacks and payload.step is Step.SUPERSEDED:
        bus.emit(RetryAsked(payload.key))
        return
    fix = f"`nondum payload uninstall {payload.payload_id}` first, or install a newer release"
    problem = Problem("ALREADY_PRESENT", "is installed already", where=payload.payload_id, fix=fix)
    raise PayloadRefused(problem)


def _drop_older(state: HostState, payload: PayloadRecord, bus: Bus) -> None:
    """Keep of the releases that were installed only the new one and the one before it."""
    if payload.step is not Step.ACTIVE:
        return
    for other in releases.other_releases(state, payload):
        if other.release not in (payload.was, payload.release) and other.release < payload.release:
            for drive in _installed_as(state, other):
                bus.emit(DriveRemoved(drive))
