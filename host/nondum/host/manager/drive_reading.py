"""Reading and letting go of drives: the daemon's side of `reader.py`."""

from __future__ import annotations

import contextlib
import logging
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from nondum.host.core.effects import ReadDrive, ReleaseDrive
from nondum.host.core.events.drives import DriveQueued, DriveRead, DriveReleased
from nondum.host.core.events.event import Emit, Event
from nondum.host.core.events.payloads import PayloadFound
from nondum.host.core.events.peers import CertificatesBrought
from nondum.host.core.keyed_queues import in_thread
from nondum.host.jobs.children import Children
from nondum.host.jobs.queue import Queue
from nondum.host.manager.payload_trust import PayloadTrust
from nondum.host.sandbox.helper import privileged
from nondum.host.trust.chain import unpacked
from nondum.sdk.errors import DriveGone, InstallFailed, Problem
from nondum.wheelhouse.format.signatures import Grant

log = logging.getLogger(__name__)

LOOK_S = 10.0
"""A drive that cannot be mounted and listed in this time hangs, on a computer that keeps up."""

AT_ONCE = 4
"""Drives that are looked through at the same time; the others wait. One that hangs takes the place
of one that does not, so these are more than there are processors to keep busy."""


@contextlib.contextmanager
def stalls_as_drive_gone(drive: str, stall_s: float) -> Iterator[None]:
    """Report a child whose drive does not answer as an error of the drive, not of the child.

    Raises `DriveGone` (DRIVE_STALLED).
    """
    try:
        yield
    except InstallFailed as error:
        if error.code != "CHILD_STALLED":
            raise
        message = f"does not answer within {stall_s:g} s"
        fix = "pull it and plug it in again, or into another port"
        raise DriveGone(Problem("DRIVE_STALLED", message, where=drive, fix=fix)) from error


class DriveReading:
    """Looks through drives in children, and unmounts them."""

    def __init__(
        self, children: Children, emit: Emit, trust: PayloadTrust, look_s: float = LOOK_S
    ) -> None:
        self._children, self._emit = children, emit
        self._look_s = look_s
        self._queue = Queue(AT_ONCE)
        self._trust = trust
        self._mounted: dict[str, Path] = {}
        """Drive → where it is, or may be, mounted."""

    async def read(self, effect: ReadDrive) -> tuple[Event, ...]:
        """Tell the payloads and certificates of a drive; take the trust files on it first.

        Raises `DriveGone`, `PayloadRefused`, `InstallFailed`.
        """
        arguments = {
            "drive": effect.drive,
            "kind": effect.kind,
            "root": str(effect.root),
            "node": str(effect.node) if effect.node else None,
            "filesystem": effect.filesystem,
            **self._trust.arguments,
        }

        def tell(ahead: int) -> None:
            self._emit(DriveQueued(effect.drive, ahead))

        async with self._queue.turn(effect.drive, tell):
            if effect.node is not None:
                self._mounted[effect.drive] = effect.root
            found = await self._look(effect.drive, arguments)
        for said in found["payloads"]:
            said["payload"] = effect.keys.get(said["digest"], said["payload"])
            self._trust.note(said["payload"], said)
        payloads = [
            PayloadFound(
                payload=said["payload"],
                drive=effect.drive,
                folder=Path(said["folder"]),
                digest=said["digest"],
                payload_id=said["payload_id"],
                version=said["version"],
                release=said["release"],
                fleet=said["fleet"],
                problems=tuple(Problem(**problem) for problem in said["problems"]),
                warnings=tuple(Problem(**problem) for problem in said["warnings"]),
                signers=tuple(said["signers"]),
                grant=Grant.parse(said["grant"]),
                built=said["built"],
            )
            for said in found["payloads"]
        ]
        certificates = tuple(found["certificates"])
        brought = (CertificatesBrought(effect.drive, certificates),) if certificates else ()
        keys = tuple(found.payload for found in payloads)
        files = unpacked(found["trust"])
        flaws = tuple(Problem(**problem) for problem in found["trust_problems"])
        changed = await self._trust.offer(effect.drive, files, flaws)
        loose = tuple(Problem(**problem) for problem in found["flaws"])
        read = DriveRead(effect.drive, keys, len(certificates), len(files), loose)
        return *changed, *brought, *payloads, read

    async def _look(self, drive: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """What is on a drive. Its child stays as long as there is something to copy."""
        found: dict[str, Any] = {"payloads": ()}
        try:
            with stalls_as_drive_gone(drive, self._look_s):
                found = await self._children.run(
                    "look", arguments, owner=drive, stall_s=self._look_s
                )
        finally:
            if all(said["problems"] for said in found["payloads"]):
                await self._children.release(drive)
        return found

    async def release(self, effect: ReleaseDrive) -> tuple[Event, ...]:
        """Unmount a drive that was mounted for reading; tell once it is not mounted any more."""
        if (root := self._mounted.get(effect.drive)) is not None:
            await in_thread(privileged().unmount, root, effect.drive, "read")
            if await in_thread(os.path.ismount, root):
                log.warning("drive %s is still mounted at %s", effect.drive, root)
                return ()
            self._mounted.pop(effect.drive, None)
        return (DriveReleased(effect.drive),)

    async def close(self) -> None:
        """Unmount all drives."""
        for drive in tuple(self._mounted):
            await self.release(ReleaseDrive(drive))
