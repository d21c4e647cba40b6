"""Disks that somebody else needs are told and not touched; the watcher outlives what vanishes."""

from __future__ import annotations

import asyncio
import contextlib
import subprocess
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
from tests.host.sources.drives.usb_devices import stick
from tests.kit.disk_images import attribute, image, on
from tests.kit.host import LAMP
from tests.kit.loop_devices import attached, can_be_made
from tests.kit.payloads import Part
from tests.kit.until import until_async

from nondum.host.core.events.drives import (
    DriveInserted,
    DriveLeftAlone,
    DriveRemoved,
    DrivesScanned,
)
from nondum.host.core.events.event import Event
from nondum.host.sandbox.helper import mounting
from nondum.host.sandbox.helper.block_devices import Machine
from nondum.host.sources.drives.blocks import BlockSource
from nondum.sdk.errors import PayloadRefused

pytestmark = [
    pytest.mark.anyio,
    pytest.mark.skipif(not can_be_made(), reason="loop devices need root"),
]
PATIENCE_S = 60.0


class Told:
    """What a source has told, in order."""

    def __init__(self) -> None:
        self._events: asyncio.Queue[Event] = asyncio.Queue()

    def tell(self, event: Event) -> None:
        self._events.put_nowait(event)

    async def next(self) -> Event:
        async with asyncio.timeout(PATIENCE_S):
            return await self._events.get()


@contextlib.asynccontextmanager
async def watched(source: BlockSource) -> AsyncIterator[Told]:
    told = Told()
    task = asyncio.create_task(source.watch(told.tell))
    try:
        yield told
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@contextlib.contextmanager
def mounted(node: Path, at: Path) -> Iterator[None]:
    at.mkdir()
    subprocess.run(["mount", node, at], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", at], check=True)


def change(node: Path) -> None:
    """Have the kernel tell of a device once more."""
    Path(f"/sys/block/{node.name}/uevent").write_text("change")


def own_by_fstab(tmp_path: Path, node: Path) -> Machine:
    """This machine, but for its fstab."""
    (tmp_path / "etc").mkdir()
    (tmp_path / "etc/fstab").write_text(f"{node} /srv/data ext4 nofail 0 2\n")
    return Machine(etc=tmp_path / "etc")


async def test_disk_of_the_machine_s_own_is_told_once_and_is_no_drive(tmp_path: Path) -> None:
    with attached(image(tmp_path / "own", Part("lamp", LAMP))) as node:
        machine = own_by_fstab(tmp_path, node)
        source = BlockSource(tmp_path / "mounts", accepts=on(tmp_path), machine=machine)
        async with watched(source) as told:
            left = await told.next()
            assert isinstance(left, DriveLeftAlone)
            assert [problem.code for problem in left.problems] == ["DRIVE_OWN"]
            assert "/srv/data" in str(left.problems[0])
            assert await told.next() == DrivesScanned("block", ())
            change(node)
            with attached(image(tmp_path / "other", Part("lamp", LAMP))):
                other = await told.next()
                assert isinstance(other, DriveInserted), "it is told of again"
                assert not other.problems
            assert await told.next() == DriveRemoved(other.drive)


async def test_drive_that_is_mounted_by_somebody_is_told_and_not_touched(tmp_path: Path) -> None:
    with attached(image(tmp_path, Part("lamp", LAMP))) as node:
        with mounted(node, tmp_path / "elsewhere"):
            with pytest.raises(PayloadRefused) as refused:
                mounting.mount(node, tmp_path / "mounts/x", "ext4")
            assert refused.value.code == "DRIVE_MOUNTED"
            assert "elsewhere" in str(refused.value)
            assert attribute(node, "ro") == 0
            (tmp_path / "elsewhere/letter").write_text("it can still be written to")
        await until_async("no process has it any more", lambda: not having(tmp_path / "elsewhere"))
        mounting.mount(node, tmp_path / "mounts/x", "ext4")
        mounting.mount(node, tmp_path / "mounts/y", "ext4")  # as it is for another host
        for name in ("x", "y"):
            mounting.unmount(tmp_path / "mounts" / name)


def having(target: Path) -> list[str]:
    """Processes that have something mounted there: sandboxes that began meanwhile, each with all
    mounts of then until it leaves them."""
    found = []
    for file in Path("/proc").glob("[0-9]*/mountinfo"):
        with contextlib.suppress(OSError):
            found += [str(file)] if f" {target} " in file.read_text() else []
    return found


async def test_what_vanishes_while_it_is_looked_at_does_not_end_the_watcher(tmp_path: Path) -> None:
    """A folder stands for what sysfs cannot give any more: reading it fails, as then."""
    with attached(image(tmp_path / "going", Part("lamp", LAMP))) as node:
        sysfs = tmp_path / "sys"
        place = sysfs / "devices/virtual/block"
        place.mkdir(parents=True)
        (place / node.name).symlink_to(stick(sysfs, "08"))
        (interface,) = sysfs.rglob("bInterfaceClass")
        interface.unlink()
        interface.mkdir()
        source = BlockSource(tmp_path / "mounts", accepts=on(tmp_path), sysfs=sysfs)
        async with watched(source) as told:
            assert await told.next() == DrivesScanned("block", ())
            with attached(image(tmp_path / "other", Part("lamp", LAMP))):
                assert isinstance(await told.next(), DriveInserted)
