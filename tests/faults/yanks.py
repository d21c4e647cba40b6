"""Drives yanked at any moment: the loop's backing file is cut off, and the kernel says it went.

What is measured is the time from that until nothing of its payload is left: no row, no process, no
mount and no folder. The good payload beside it must not notice.
"""

from __future__ import annotations

import asyncio
import os
import random
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tests.kit.disk_images import make_ext4, on
from tests.kit.host import LAMP, HostInProcess, host_in_process
from tests.kit.loop_devices import attach, cut_off, detach
from tests.kit.payloads import Part, make_payload, make_wheel
from tests.kit.until import until_async

from nondum.host.core.records.step import Step
from nondum.host.manager.state_folders import Folders
from nondum.host.sandbox.helper.mountinfo import mounted_below
from nondum.host.sources.drives.blocks import BlockSource

GOOD, BAD = "org.example.good", "org.example.lamp"
PHASES = ("look", "copy", "install", "run")
"""What is going on when the drive is yanked: see `phase_of`."""
BALLAST_MB = 8
CUT_TO = 1024**2
PRUNED_S = 20.0
IDLE_S = 0.5
CALM = 3
"""Looks in a row at which nothing may be left."""
AGAIN = 25
"""Yanks after which the time that all takes is measured again: the machine has other work, too."""


@dataclass
class Yanks:
    """What came of them."""

    seconds: dict[str, list[float]] = field(default_factory=lambda: {p: [] for p in PHASES})
    """Phase → times until nothing was left."""
    stuck_mounts: int = 0
    left_over: list[str] = field(default_factory=list)
    disturbed: int = 0
    """How often the good payload was not as it had been."""

    @property
    def all_seconds(self) -> list[float]:
        """Of all phases, in order of length."""
        return sorted(s for each in self.seconds.values() for s in each)


class Bench:
    """A host with a good payload, and a drive to be yanked. Made by `bench`."""

    def __init__(self, host: HostInProcess, image: Path, root: Path) -> None:
        self.host, self._image, self._root = host, image, root
        self.told = Yanks()
        self._good = host.workers.pids()["good"]
        self._kept = set(self._folders())
        self._whole_s = 0.0

    async def measure(self) -> None:
        """See how long a payload takes from its drive's coming until it is active."""
        async with self._stick() as (node, image):
            began = time.monotonic()
            await self.host.until_step(BAD, Step.ACTIVE)
            self._whole_s = time.monotonic() - began
            await asyncio.to_thread(_cut, node, image)
            await self._until_pruned()

    async def yank_at(self, phase: str) -> None:
        """Insert the drive and yank it as soon as a phase has begun."""
        async with self._stick() as (node, image):
            await self.host.until(lambda: self._is_there() and self._phase() == phase)
            began = time.monotonic()
            await asyncio.to_thread(_cut, node, image)
            await self._until_pruned()
            self.told.seconds[phase].append(time.monotonic() - began)
            self._look_around()

    async def yank(self, share: float) -> None:
        """Insert the drive and yank it at a share of the time that all takes; 1 and more: while it
        runs, and when nothing is wanted of it any more."""
        async with self._stick() as (node, image):
            await asyncio.sleep(share * self._whole_s + (IDLE_S if share > 1 else 0.0))
            phase = self._phase()
            began = time.monotonic()
            await asyncio.to_thread(_cut, node, image)
            await self._until_pruned()
            self.told.seconds[phase].append(time.monotonic() - began)
            self._look_around()

    @asynccontextmanager
    async def _stick(self) -> AsyncIterator[tuple[Path, Path]]:
        """A device on a copy of the image, which is taken away at the end."""
        copy = self._root / "stick.img"
        await asyncio.to_thread(copy.write_bytes, self._image.read_bytes())
        node = await asyncio.to_thread(attach, copy)
        try:
            yield node, copy
        finally:
            await asyncio.to_thread(detach, node)

    async def _until_pruned(self) -> None:
        await self.host.until(lambda: not self._is_there() and self.host.payload(BAD) is None)
        calm = 0

        def is_calm() -> bool:
            nonlocal calm  # a child that is being killed may still make a mount point
            calm = 0 if self._left() else calm + 1
            return calm == CALM

        await until_async("nothing left", is_calm, evidence=self._left, patience_s=PRUNED_S)

    def _is_there(self) -> bool:
        return any(drive.kind == "block" for drive in self.host.snapshot.drives)

    def _left(self) -> list[str]:
        """Folders, mounts and processes of the payload that was yanked."""
        mounts = [str(path) for path in mounted_below(self.host.folders.mounts)]
        workers = [id for id in self.host.workers.pids() if id != "good"]
        return [*(set(self._folders()) - self._kept), *mounts, *workers]

    def _folders(self) -> list[str]:
        names = ("staging", "payloads", "venvs", "scratch", "mounts")
        roots = [self.host.folders.root / name for name in names]
        return [str(path) for root in roots if root.is_dir() for path in root.iterdir()]

    def _phase(self) -> str:
        record = self.host.payload(BAD)
        if record is None:
            return "look"
        if record.step is Step.ACTIVE:
            return "run"
        return "copy" if record.step is Step.RECEIVED else "install"

    def _look_around(self) -> None:
        self.told.stuck_mounts += len(mounted_below(self.host.folders.mounts))
        self.told.left_over += self._left()
        self.told.disturbed += self.host.workers.pids() != {"good": self._good}


@asynccontextmanager
async def bench(root: Path) -> AsyncIterator[Bench]:
    """A host under `root`, with a good payload at work and an image to attach."""
    content, image = root / "content", root / "whole.img"
    data = {"ballast.bin": os.urandom(BALLAST_MB * 2**20)}
    ballast = make_wheel(root, "ballast", "1.0", data)
    make_payload(content, Part("lamp", LAMP, wheels=[ballast]), payload_id=BAD)
    make_ext4(content, image, size_mb=3 * BALLAST_MB)
    make_payload(root / "good", Part("good", LAMP), payload_id=GOOD)

    def sources(folders: Folders) -> list[BlockSource]:
        return [BlockSource(folders.mounts, accepts=on(root))]

    async with host_in_process(root, sources=sources) as host:
        host.plug(root / "good", "good")
        await host.until_step(GOOD, Step.ACTIVE)
        yield Bench(host, image, root)


async def yank_all(made: Bench, points: int, *, seed: int) -> Yanks:
    """Yank at `points` moments, uniformly from the coming of the drive until it idles."""
    moments = random.Random(seed)
    for number in range(points):
        if number % AGAIN == 0:
            await made.measure()
        await made.yank(moments.uniform(0.0, 1.3))
    return made.told


def _cut(node: Path, image: Path) -> None:
    """What is left of a stick that is pulled: errors; and what the kernel says of it."""
    cut_off(image, CUT_TO)
    Path(f"/sys/block/{node.name}/uevent").write_text("remove")
