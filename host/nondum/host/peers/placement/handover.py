"""What one peer may fetch of a payload that is handed over to it, and nothing else.

Files are copied from the drive by a child, each when it is first asked for; peers read the copies.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from nondum.host.core.keyed_queues import in_thread
from nondum.host.jobs.children import Children, OnProgress
from nondum.host.manager.state_folders import Folders, remove
from nondum.host.peers.placement.decide import Parcel
from nondum.host.sandbox.helper import privileged
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers import CallFailed
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.format.signatures import MAX_SIGNATURE_BYTES


@frozen
class Described:
    """What is told first of a payload."""

    contents: int
    """Size of its contents list."""
    signature: bytes | None


class Handover:
    """One payload's files for one peer. `await open()` it, and `await close()` it."""

    def __init__(
        self, name: str, parcel: Parcel, folders: Folders, children: Children, *, reserve_mb: int
    ) -> None:
        """`name` tells it from all others of this daemon."""
        self._parcel, self._children, self._reserve_mb = parcel, children, reserve_mb
        self._folder = folders.handover / name
        self._mount = folders.mounts / f"handover-{name}"
        self._files: dict[str, Path] = {}
        self._copying = asyncio.Lock()

    async def open(self) -> Described:
        """Copy what the payload is judged by. Raises `DriveGone`, `PayloadRefused`,
        `InstallFailed`."""
        size = await self._copy(None)
        self._files[self._parcel.digest] = self._folder / contents.NAME
        signature = await in_thread(_signature, self._folder / contents.SIGNATURE_NAME)
        return Described(size, signature)

    async def want(self, hashes: Collection[str], on_progress: OnProgress | None = None) -> None:
        """Have files ready to be read. Raises as `open`."""
        missing = sorted(set(hashes) - self._files.keys())
        if missing:
            await self._copy(missing, on_progress)

    async def read(self, sha256: str, offset: int, length: int) -> bytes:
        """A piece of a file, shorter at its end. Raises `CallFailed` (NOT_OFFERED)."""
        path = self._files.get(sha256)
        if path is None:
            told = "no file of that hash is handed over to this host"
            raise CallFailed(Problem("NOT_OFFERED", told, where=self._parcel.payload_id))
        return await asyncio.to_thread(_read, path, offset, length)

    async def drop_wheels(self) -> None:
        """The peer has what it wanted: keep only what the payload is judged by."""
        wheels = self._folder / "wheels"
        gone = [sha256 for sha256, path in self._files.items() if wheels in path.parents]
        for sha256 in gone:
            del self._files[sha256]
        await in_thread(remove, wheels)

    async def close(self) -> None:
        """Keep nothing."""
        self._files.clear()
        await in_thread(remove, self._folder)

    async def _copy(
        self, wanted: Collection[str] | None, on_progress: OnProgress | None = None
    ) -> int:
        async with self._copying:
            try:
                copied = await self._children.run(
                    "hand_over",
                    self._arguments(wanted),
                    owner=self._parcel.drive.id,
                    on_progress=on_progress,
                )
            finally:
                if self._parcel.drive.node is not None:
                    drive = self._parcel.drive.id
                    await in_thread(privileged().unmount, self._mount, drive, "handover")
        self._files |= {sha256: self._folder / path for sha256, path in copied["files"]}
        return int(copied["contents"])

    def _arguments(self, wanted: Collection[str] | None) -> Mapping[str, Any]:
        drive = self._parcel.drive
        return {
            "drive": drive.id,
            "node": str(drive.node) if drive.node else None,
            "filesystem": drive.filesystem,
            # A drive that was let go as safe to pull is not mounted any more, or again for others.
            "root": str(self._mount if drive.node else drive.root),
            "folder": str(self._parcel.folder.relative_to(drive.root)),
            "digest": self._parcel.digest,
            "target": str(self._folder),
            "wanted": None if wanted is None else list(wanted),
            "reserve_mb": self._reserve_mb,
        }


def _signature(path: Path) -> bytes | None:
    return path.read_bytes()[:MAX_SIGNATURE_BYTES] if path.exists() else None


def _read(path: Path, offset: int, length: int) -> bytes:
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        return os.pread(descriptor, length, offset)
    finally:
        os.close(descriptor)
