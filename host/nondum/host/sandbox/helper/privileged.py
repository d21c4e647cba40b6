"""The seam of what needs root: done in this process, by the helper, or refused."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Protocol

from nondum.host.core.feedback_state import State
from nondum.host.sandbox.cgroups.groups import NoTree
from nondum.host.sandbox.cgroups.limits import Tree
from nondum.host.sandbox.helper import mounting, stop_key, worker_users
from nondum.host.sandbox.helper.client import SOCKET, HelperClient
from nondum.host.sandbox.helper.lamps import Lamps
from nondum.host.sandbox.helper.presses import Presses
from nondum.sdk.errors import InstallFailed, Problem


class Privileged(Protocol):
    """What a daemon needs root for. All of it may block: not for the loop."""

    def mounts(self, folder: Path) -> Path:
        """Where drives are mounted to be read: in this folder of the daemon's, or the helper's."""
        ...

    def mount(self, node: Path, root: Path, filesystem: str, drive: str, use: str) -> Path:
        """Mount a drive, and tell where: at `root`, or where the helper has its mounts.

        `use` is `read`, or `handover` to another host: a drive may be mounted once for each.

        Raises `PayloadRefused` (FS_UNSUPPORTED, FS_ERROR), `DriveGone`, `InstallFailed`.
        """
        ...

    def unmount(self, root: Path, drive: str, use: str) -> None:
        """Detach what was mounted so; nothing there is fine."""
        ...

    def unmount_all(self, folder: Path) -> None:
        """Detach all drives of a daemon that has died."""
        ...

    def put_node(self, component: str, need: str, node: Path, user: int | None = None) -> Path:
        """A node of a device that this daemon's user may open, or that of a worker.

        Raises `NondumError`.
        """
        ...

    def take_node(self, component: str, need: str) -> None:
        """Remove a node that was made for a component."""
        ...

    @property
    def users(self) -> range:
        """Users of the machine that workers may be; empty: none but the daemon's."""
        ...

    def map_users(self, pid: int) -> None:
        """Have the user namespace that a process has just made know them. Raises `OSError`."""
        ...

    def map_folder(self, mount: int, user: int) -> None:
        """Have a mount of a folder, which is not in place yet, show the daemon's files as those of
        one of them. Raises `OSError`."""
        ...

    def show_lamps(self, names: tuple[str, ...], state: State, kept: Path) -> None:
        """Have lamps show a state; what they showed before is kept, by the helper or in `kept`.

        Raises `InstallFailed` (LAMP_…).
        """
        ...

    def end_lamps(self, names: tuple[str, ...], kept: Path) -> None:
        """Have lamps show what they showed before."""
        ...

    def cgroups(self) -> Tree:
        """Where cgroups are that this process may not make itself."""
        ...

    def stop_key(self, device: Path, code: int) -> Presses:
        """Listen to a key; the helper listens to the one that root's configuration names.

        Raises `InstallFailed` (STOP_KEY, HELPER_SILENT).
        """
        ...


class InProcess:
    """For a daemon that is root."""

    def mounts(self, folder: Path) -> Path:
        """Its own folder."""
        return folder

    def mount(self, node: Path, root: Path, filesystem: str, drive: str, use: str) -> Path:
        """Mount a drive (see `Privileged`)."""
        mounting.mount(node, root, filesystem, drive=drive)
        return root

    def unmount(self, root: Path, drive: str, use: str) -> None:
        """Detach what is mounted there."""
        mounting.unmount(root)

    def unmount_all(self, folder: Path) -> None:
        """Detach all drives."""
        mounting.unmount_all(folder)

    def put_node(self, component: str, need: str, node: Path, user: int | None = None) -> Path:
        """Root opens the node itself and lends it to workers (`workers/device_ownership.py`)."""
        return node

    def take_node(self, component: str, need: str) -> None:
        """Nothing was made."""

    @property
    def users(self) -> range:
        """Those of root."""
        return worker_users.OF_ROOT

    def map_users(self, pid: int) -> None:
        """Write the map (see `Privileged`)."""
        process = worker_users.opened(pid)
        try:
            worker_users.map_namespace_of_root(process)
        finally:
            os.close(process)

    def map_folder(self, mount: int, user: int) -> None:
        """Not needed: root gives the folder itself away (`nondum.host.workers.scratch.give`). It
        takes a fork, which only the helper can do safely: a daemon has threads."""
        raise PermissionError("only the helper maps folders")

    def show_lamps(self, names: tuple[str, ...], state: State, kept: Path) -> None:
        """Set them (see `Privileged`)."""
        Lamps(names, kept).show(state)

    def end_lamps(self, names: tuple[str, ...], kept: Path) -> None:
        """Set them back."""
        Lamps(names, kept).end()

    def cgroups(self) -> Tree:
        """None but its own."""
        return NoTree()

    def stop_key(self, device: Path, code: int) -> Presses:
        """Read it from the device."""
        return stop_key.opened(device, code)


class Unprivileged(InProcess):
    """For a user's daemon without the helper: no drives but slots, and what the user may open, be
    it a device or a lamp."""

    def mount(self, node: Path, root: Path, filesystem: str, drive: str, use: str) -> Path:
        """Refuse. Raises `InstallFailed` (HELPER_MISSING)."""
        raise InstallFailed(
            Problem(
                "HELPER_MISSING",
                "drives are mounted by root or by the helper, and neither is here",
                where=drive,
                need=str(SOCKET),
                have="no such socket",
                fix="`systemctl start nondum-helper.socket`, or run the daemon as root",
            )
        )

    def unmount_all(self, folder: Path) -> None:
        """Nothing was mounted."""

    @property
    def users(self) -> range:
        """None."""
        return range(0)


def privileged(socket: Path = SOCKET) -> Privileged:
    """What this process can have done: as root itself, else by the helper if it is there."""
    if os.geteuid() == 0:
        return InProcess()
    return HelperClient(socket) if socket.exists() else Unprivileged()
