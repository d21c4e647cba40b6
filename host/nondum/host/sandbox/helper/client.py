"""Asks the helper: for a daemon that is not root, and its children."""

from __future__ import annotations

import contextlib
import logging
import os
import re
import socket
import stat
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nondum.host.core.feedback_state import State
from nondum.host.rpc.outcomes import unpacked
from nondum.host.sandbox.cgroups.limits import CgroupLimits, Usage
from nondum.host.sandbox.helper import requests, worker_users
from nondum.host.sandbox.helper.requests import Request
from nondum.sdk.errors import InstallFailed, NondumError, Problem, ProtocolViolation
from nondum.sdk.wire import MAX_PACKET, Event, Reply, WireMessage, decode

SOCKET = Path("/run/nondum-helper/helper.sock")
MOUNTS = Path("/run/nondum-helper/mounts")
DEVICES = Path("/run/nondum-helper/devices")
"""Below it, component by component, are the nodes that the helper makes."""
START_S = 45.0
"""For the helper to begin: systemd starts it for the first question, on a slow machine that has
other things to do. With what follows it is less than a job process is waited for."""
WAIT_S = 15.0
"""From then on: longer than the helper waits for a drive."""
PAUSE_S = 0.02

log = logging.getLogger(__name__)


class HelperClient:
    """Satisfies `Privileged` with one connection for each question."""

    def __init__(self, path: Path = SOCKET) -> None:
        self._path = path

    def mounts(self, folder: Path) -> Path:
        """The helper's folder."""
        return MOUNTS

    def mount(self, node: Path, root: Path, filesystem: str, drive: str, use: str) -> Path:
        """Have a drive mounted where the helper has its mounts (see `Privileged`)."""
        _, _, number = drive.partition("-")
        request = requests.Mount(node.name, int(number) if number else None, filesystem, use)
        return Path(self._ask(request)["at"])

    def unmount(self, root: Path, drive: str, use: str) -> None:
        """Have what was mounted detached."""
        self._try(requests.Unmount(drive, use))

    def unmount_all(self, folder: Path) -> None:
        """Have all drives detached."""
        self._try(requests.UnmountAll())

    def put_node(self, component: str, need: str, node: Path, user: int | None = None) -> Path:
        """Have a node made, of a device that the user may not open; else the device's own."""
        found = node.stat()
        is_open = os.access(node, os.R_OK | os.W_OK) if user is None else _is_open(found)
        if is_open or not stat.S_ISCHR(found.st_mode):
            return node
        major, minor = os.major(found.st_rdev), os.minor(found.st_rdev)
        return Path(self._ask(requests.PutNode(component, _word(need), major, minor, user))["at"])

    def take_node(self, component: str, need: str) -> None:
        """Have a node removed."""
        self._try(requests.TakeNode(component, _word(need)))

    @property
    def users(self) -> range:
        """Those that the helper maps."""
        return worker_users.OF_SERVICE

    def map_users(self, pid: int) -> None:
        """Have a new user namespace know them."""
        with _as_os_error():
            self._ask(requests.MapUsers(pid))

    def map_folder(self, mount: int, user: int) -> None:
        """Have a mount show this user's files as those of a worker's."""
        with _as_os_error():
            self._ask(requests.MapFolder(user), mount)

    def show_lamps(self, names: tuple[str, ...], state: State, kept: Path) -> None:
        """Have lamps show a state: those that the helper's own configuration names."""
        self._ask(requests.ShowLamps(state))

    def end_lamps(self, names: tuple[str, ...], kept: Path) -> None:
        """Have them show what they showed before."""
        self._ask(requests.EndLamps())

    def cgroups(self) -> HelperTree:
        """The cgroups of the helper's making. Raises `NondumError`."""
        return HelperTree(self)

    def stop_key(self, device: Path, code: int) -> PressesOfHelper:
        """Listen to the key that the helper's own configuration names."""
        asked = _opened()
        try:
            said = self._asked(asked, requests.ListenToStopKey())
            asked.settimeout(0)
            match said:
                case Event(requests.LISTENING, body={"down": bool(is_down)}):
                    return PressesOfHelper(asked, is_down=is_down)
            _result(said)
            raise _silent("it does not listen")
        except BaseException:
            asked.close()
            raise

    def ask(self, request: Request) -> dict[str, Any]:
        """Ask one thing. Raises what the helper raised, `InstallFailed` (HELPER_SILENT)."""
        return self._ask(request)

    def _try(self, request: Request) -> None:
        """Ask for something to be taken away; should that fail, the next daemon's sweep does it."""
        try:
            self._ask(request)
        except NondumError as error:
            log.warning("%s", error)

    def _ask(self, request: Request, *descriptors: int) -> dict[str, Any]:
        with _opened() as asked:
            return _result(self._asked(asked, request, *descriptors))

    def _asked(self, asked: socket.socket, request: Request, *descriptors: int) -> WireMessage:
        """Ask over a socket; what comes first."""
        try:
            asked.settimeout(START_S)
            _connect(asked, self._path)
            # Who is turned away is answered before the question is heard.
            with contextlib.suppress(BrokenPipeError):
                socket.send_fds(asked, [requests.encode(request)], descriptors)
            said = _said(asked)
            if isinstance(said, Event) and said.name == requests.HEARD:
                asked.settimeout(WAIT_S)
                said = _said(asked)
        except OSError as error:
            raise _silent(str(error)) from error
        return said


class PressesOfHelper:
    """Presses of the stop key, as the helper tells them."""

    def __init__(self, connection: socket.socket, *, is_down: bool) -> None:
        """Own the connection."""
        self._connection, self.is_down_at_first = connection, is_down

    def fileno(self) -> int:
        """To wait for."""
        return self._connection.fileno()

    def read(self) -> int:
        """How many presses have come. Raises `OSError` when the helper tells no more."""
        try:
            data = self._connection.recv(MAX_PACKET)
        except BlockingIOError:
            return 0
        with contextlib.suppress(ProtocolViolation):
            match decode(data):
                case Event(requests.PRESSED, body={"times": int(times)}):
                    return times
        raise ConnectionResetError("the helper does not listen any more")

    def close(self) -> None:
        """Hang up."""
        self._connection.close()


class HelperTree:
    """Satisfies `Tree`: cgroups that the helper makes; their use is read directly."""

    def __init__(self, helper: HelperClient) -> None:
        self._helper = helper
        listed = helper.ask(requests.ListCgroups())
        self.kind: str = listed["kind"]
        self.controllers = frozenset(listed["controllers"])

    def make(self, name: str) -> None:
        """Make a cgroup."""
        self._told(requests.MakeCgroup(name))

    def limit(self, name: str, limits: CgroupLimits) -> None:
        """Set its limits."""
        self._told(
            requests.LimitCgroup(
                name, limits.memory_mb, limits.tasks, limits.cpu_weight, limits.processors
            )
        )

    def add(self, name: str, pid: int) -> None:
        """Put one process in."""
        self._told(requests.FillCgroup(name, pid))

    def kill(self, name: str) -> None:
        """SIGKILL all that is in it."""
        self._told(requests.KillCgroup(name))

    def remove(self, name: str) -> bool:
        """Remove it if it is empty."""
        return bool(self._told(requests.RemoveCgroup(name))["gone"])

    def pids(self, name: str) -> tuple[int, ...]:
        """The processes in it."""
        return tuple(self._told(requests.ReadCgroup(name))["pids"])

    def usage(self, name: str) -> Usage:
        """What it uses."""
        return Usage(**self._told(requests.ReadCgroup(name))["usage"])

    def names(self) -> tuple[str, ...]:
        """All cgroups."""
        return tuple(self._told(requests.ListCgroups())["cgroups"])

    def close(self) -> None:
        """The place of the cgroups stays the helper's."""

    def _told(self, request: Request) -> dict[str, Any]:
        """Ask; what fails is an `OSError`, as it is with one's own cgroups."""
        with _as_os_error():
            return self._helper.ask(request)


@contextlib.contextmanager
def _as_os_error() -> Iterator[None]:
    try:
        yield
    except NondumError as error:
        raise OSError(str(error)) from error


def _opened() -> socket.socket:
    """A socket to ask with. Raises `InstallFailed` (HELPER_SILENT)."""
    try:
        return socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    except OSError as error:
        raise _silent(str(error)) from error


def _connect(asked: socket.socket, path: Path) -> None:
    """Connect, once the queue of waiting connections has a free place (listen(2))."""
    until_s = time.monotonic() + WAIT_S
    while True:
        try:
            return asked.connect(str(path))
        except BlockingIOError:
            if time.monotonic() >= until_s:
                raise
            time.sleep(PAUSE_S)


def _said(asked: socket.socket) -> WireMessage:
    """What comes next. Raises `InstallFailed` (HELPER_SILENT)."""
    if data := _received(asked):
        return decode(data)
    raise _silent("it hung up")


def _received(asked: socket.socket) -> bytes:
    try:
        return asked.recv(MAX_PACKET)
    except ConnectionResetError:  # the question was not read, which is told first
        return asked.recv(MAX_PACKET)


def _result(said: WireMessage) -> dict[str, Any]:
    """What was asked for. Raises what the helper raised, `InstallFailed` (HELPER_SILENT)."""
    if isinstance(said, Reply):
        result: dict[str, Any] = unpacked(said.body)
        return result
    raise _silent("it says something else")


def _is_open(node: os.stat_result) -> bool:
    """Whether everybody may open it, or a group that workers have from this process."""
    group = stat.S_IRGRP | stat.S_IWGRP if node.st_gid in os.getgroups() else 0
    others = stat.S_IROTH | stat.S_IWOTH
    return any(wanted and node.st_mode & wanted == wanted for wanted in (group, others))


def _word(need: str) -> str:
    """A need's name, as a file may have it.

    >>> _word("front camera")
    'front_camera'
    """
    return re.sub(r"[^A-Za-z0-9-]", "_", need)[:63]


def _silent(why: str) -> InstallFailed:
    fix = "`systemctl status nondum-helper.socket nondum-helper.service`"
    return InstallFailed(Problem("HELPER_SILENT", f"the helper does not answer ({why})", fix=fix))
