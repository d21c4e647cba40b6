"""What the helper does for each request, on paths that it chooses itself."""

from __future__ import annotations

import os
import pwd
import signal
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from nondum.host.sandbox.cgroups.limits import Tree
from nondum.host.sandbox.helper import mounting, requests, worker_users
from nondum.host.sandbox.helper.device_nodes import Nodes
from nondum.host.sandbox.helper.disks import Disks
from nondum.host.sandbox.helper.drive_nodes import drive_name
from nondum.host.sandbox.helper.lamps import Lamps
from nondum.host.sandbox.helper.requests import Request, refused
from nondum.host.sandbox.helper.stop_key import PressesOfDevice
from nondum.sdk.frozen import frozen

MOST_DRIVES = 128
MOST_CGROUPS = 512


@frozen
class Service:
    """Root's end."""

    uid: int
    """The only user who is served; processes of no other are put into cgroups."""
    mounts: Path
    disks: Disks
    nodes: Nodes
    tree: Tree
    lamps: Callable[[], Lamps]
    """Those that root's configuration names now."""
    stop_key: Callable[[], PressesOfDevice]
    """Listens to the one that root's configuration names now."""

    @property
    def gid(self) -> int:
        """The group of that user."""
        return pwd.getpwuid(self.uid).pw_gid

    def serve(self, request: Request, descriptor: int = -1) -> dict[str, Any]:
        """Do what is asked, with what came with it. Raises `NondumError`, `OSError`."""
        match request:
            case requests.Mount():
                return {"at": str(self._mount(request))}
            case requests.Unmount(drive, use):
                mounting.unmount(self.mounts / _folder(drive, use))
            case requests.UnmountAll():
                mounting.unmount_all(self.mounts)
            case requests.PutNode(component, need, major, minor, user):
                if not component:
                    raise refused("a node is some component's")
                if user is not None:
                    _check_user(user)
                return {"at": str(self.nodes.put(component, need, major, minor, user))}
            case requests.TakeNode(component, need):
                self.nodes.take(component, need)
            case requests.ClearNodes(component):
                self.nodes.clear(component)
            case requests.MapUsers(pid):
                self._map_users(pid)
            case requests.MapFolder(user):
                self._map_folder(descriptor, user)
            case requests.ShowLamps(state):
                self.lamps().show(state)
            case requests.EndLamps():
                self.lamps().end()
            case _:
                return self._serve_cgroup(request)
        return {}

    def _mount(self, request: requests.Mount) -> Path:
        node = self.disks.node(request.device, request.diskseq, ours=self.mounts)
        self.mounts.mkdir(mode=0o755, parents=True, exist_ok=True)
        if sum(1 for _ in self.mounts.iterdir()) >= MOST_DRIVES:
            raise refused(f"{MOST_DRIVES} drives are mounted already")
        drive = drive_name(request.device, request.diskseq)
        target = self.mounts / _folder(drive, request.use)
        try:
            target.mkdir(mode=0o755)  # who makes the folder mounts the drive
        except FileExistsError:
            raise refused("it is mounted already, or just being mounted", drive) from None
        try:
            mounting.mount(node, target, request.filesystem, drive=drive)
        finally:
            if target.is_dir() and not target.is_mount():
                target.rmdir()
        return target

    def _map_users(self, pid: int) -> None:
        """The kernel takes one map for each namespace, and of one just below the machine's only."""
        with self._held(pid):
            process = worker_users.opened(pid)
        try:
            worker_users.map_namespace(process, self.uid, self.gid)
        finally:
            os.close(process)

    def _map_folder(self, mount: int, user: int) -> None:
        """Map a folder of the daemon. Files of other users in it have no mapped owner in such a
        mount, so the daemon gains nothing by mapping one."""
        _check_user(user)
        about = os.fstat(mount)
        if not stat.S_ISDIR(about.st_mode) or about.st_uid != self.uid:
            raise refused("that is no folder of yours")
        worker_users.map_folder(mount, (self.uid, self.gid), user)

    def _serve_cgroup(self, request: Request) -> dict[str, Any]:
        tree = self.tree
        match request:
            case requests.ListCgroups():
                controllers = sorted(tree.controllers)
                return {"kind": tree.kind, "controllers": controllers, "cgroups": tree.names()}
            case requests.ReadCgroup(cgroup):
                return {"pids": tree.pids(cgroup)[:4096], "usage": asdict(tree.usage(cgroup))}
            case requests.MakeCgroup(cgroup):
                if len(tree.names()) >= MOST_CGROUPS:
                    raise refused(f"there are {MOST_CGROUPS} cgroups already")
                tree.make(cgroup)
            case requests.LimitCgroup(cgroup):
                tree.limit(cgroup, request.limits)
            case requests.FillCgroup(cgroup, pid):
                with self._held(pid):
                    tree.add(cgroup, pid)
            case requests.KillCgroup(cgroup):
                tree.kill(cgroup)
            case requests.RemoveCgroup(cgroup):
                return {"gone": tree.remove(cgroup)}
        return {}

    @contextmanager
    def _held(self, pid: int) -> Iterator[None]:
        """A process of the caller's user, and no other that has come to its number since."""
        if pid <= 1:
            raise refused("that is no process of yours")
        descriptor = os.pidfd_open(pid)
        try:
            if set(_users(pid)) != {self.uid}:
                raise refused("that is no process of yours", str(pid))
            yield
            signal.pidfd_send_signal(descriptor, 0)  # it is still the same
        finally:
            os.close(descriptor)


def _check_user(user: int) -> None:
    if user not in worker_users.OF_SERVICE:
        raise refused("that is no user of workers", str(user))


def _folder(drive: str, use: str) -> str:
    """Where a drive is mounted; the daemon knows beforehand where it reads one."""
    return drive if use == "read" else f"{drive}.{use}"


def _users(pid: int) -> Iterator[int]:
    """Real, effective, saved and file system user of a process."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("Uid:"):
            yield from map(int, line.split()[1:])
