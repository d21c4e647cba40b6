"""Reading and letting go of drives: the daemon's side of `reader.py`."""

from __future__ import annotations

from pathlib import Path

from nondum.host.drives import mounting
from nondum.host.effects import ReadDrive, ReleaseDrive
from nondum.host.events import CertificatesBrought, DriveRead, Event, PayloadFound
from nondum.host.lifecycle.children import Children
from nondum.host.lifecycle.lanes import in_thread
from nondum.sdk.errors import DriveGone, InstallFailed, Problem

LOOK_S = 10.0
"""A drive that cannot be mounted and listed in this time hangs."""


class DriveReading:
    """Looks through drives in children, and unmounts them."""

    def __init__(self, children: Children, *, allow_unsigned: bool) -> None:
        self._children = children
        self._allow_unsigned = allow_unsigned
        self._mounted: dict[str, Path] = {}
        """Drive → where it is, or may be, mounted."""

    async def read(self, effect: ReadDrive) -> tuple[Event, ...]:
        """Tell the payloads and certificates of a drive.

        Raises `DriveGone`, `PayloadRefused`, `InstallFailed`.
        """
        if effect.node is not None:
            self._mounted[effect.drive] = effect.root
        arguments = {
            "kind": effect.kind,
            "root": str(effect.root),
            "node": str(effect.node) if effect.node else None,
            "filesystem": effect.filesystem,
            "allow_unsigned": self._allow_unsigned,
        }
        try:
            found = await self._children.run("look", arguments, stall_s=LOOK_S)
        except InstallFailed as error:
            if error.code != "CHILD_STALLED":
                raise
            message = f"does not answer within {LOOK_S:g} s"
            fix = "pull it and plug it in again, or into another port"
            problem = Problem("DRIVE_STALLED", message, where=effect.drive, fix=fix)
            raise DriveGone(problem) from error
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
            )
            for said in found["payloads"]
        ]
        certificates = tuple(found["certificates"])
        brought = (CertificatesBrought(effect.drive, certificates),) if certificates else ()
        keys = tuple(found.payload for found in payloads)
        return *brought, *payloads, DriveRead(effect.drive, keys, len(certificates))

    async def release(self, effect: ReleaseDrive) -> tuple[Event, ...]:
        """Unmount a drive that was mounted for reading."""
        if (root := self._mounted.pop(effect.drive, None)) is not None:
            await in_thread(mounting.unmount, root)
        return ()

    async def close(self) -> None:
        """Unmount all drives."""
        for drive in tuple(self._mounted):
            await self.release(ReleaseDrive(drive))
