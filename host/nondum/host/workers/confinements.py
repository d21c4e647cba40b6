"""What holds a worker at each level: how its interpreter is started, and what it is told to give up
before it becomes a worker.
"""

from __future__ import annotations

import base64
import contextlib
import logging
import os
import stat
import zlib
from collections.abc import Collection, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from nondum.host.sandbox.helper import privileged
from nondum.host.sandbox.inside import mounts
from nondum.host.sandbox.levels import bubblewrap, landlock, refusals
from nondum.host.sandbox.levels.bubblewrap import Ground
from nondum.host.sandbox.levels.filters import Rule
from nondum.host.sandbox.levels.users import FIRST_USER, USERS, NewNamespace, Users
from nondum.host.workers.spec import WorkerSpec, base_interpreter
from nondum.wheelhouse.format.confinement import Level

log = logging.getLogger(__name__)

BOOTSTRAP = bubblewrap.INSIDE / "bootstrap.py"
_ALL = (Path("/"),)
_LISTED = stat.S_IROTH | stat.S_IXOTH
_CHANGES_GROUND = frozenset({"network", "gpu"})
SHARED_MB = 64
"""Size of /dev/shm."""

NODES: Mapping[str, tuple[str, ...]] = {
    "audio": ("/dev/snd",),
    "gpu": ("/dev/dri", "/dev/kfd", "/dev/nvidia*"),
}
"""Device nodes that a permission stands for."""
INSTRUMENTS = (
    *("/dev/pts", "/dev/bus/usb", "/dev/ttyUSB*", "/dev/ttyACM*", "/dev/video*"),
    *("/dev/hidraw*", "/dev/i2c-*", "/dev/spidev*", "/dev/gpiochip*", "/dev/media*"),
)
"""Where no sandbox can be made for a worker, what one that declares devices may open."""


@dataclass(frozen=True, slots=True)
class Entry:
    """How one interpreter becomes one worker."""

    restrictions: Mapping[str, Any]
    """See `nondum.host.sandbox.inside.restrict`."""
    mounts: Mapping[str, Any] | None = None
    """See `nondum.host.sandbox.inside.mounts`; None: it stays where it is."""
    ruleset: int | None = None
    """Landlock's, by descriptor."""
    user: int | None = None
    """The user of the machine that the worker is, if not the host's."""

    @property
    def maps_scratch(self) -> bool:
        """Whether its scratch folder stays the host's, and is shown as that user's."""
        return self.mounts is not None and bool(self.mounts["maps_scratch"])


class Confinement(Protocol):
    """One level's way to hold workers."""

    level: Level
    has_init: bool
    """Whether its interpreter is process 1 of a namespace, and hears orders as long as it runs."""
    has_users: bool
    """Whether its interpreter is in a namespace whose users are mapped from outside."""
    without: frozenset[str]
    """Restrictions that are left out, so that tests see that each matters; otherwise none."""

    def ground(self, spec: WorkerSpec | None) -> Ground:
        """What a worker's interpreter is started with, or that of a spare, of any worker."""
        ...

    def command(
        self, ground: Ground, orders: int, namespace: NewNamespace | None = None
    ) -> list[str]:
        """The command that starts it; `orders` is the descriptor that it hears at.

        `namespace` is given if it `has_users`.
        """
        ...

    def entry(self, spec: WorkerSpec, ground: Ground) -> AbstractContextManager[Entry]:
        """How it becomes this worker. Raises `OSError`."""
        ...


class Unconfined:
    """Level `none`: resource limits, no new privileges and no special files, which all levels
    have."""

    level = Level.NONE
    has_init = False
    has_users = False
    without: frozenset[str] = frozenset()

    def __init__(self, *, without: Collection[str] = ()) -> None:
        self.without = frozenset(without)

    def ground(self, spec: WorkerSpec | None) -> Ground:
        """The interpreter, wherever it is."""
        return Ground(spec.python if spec else base_interpreter(), _ALL)

    def command(
        self, ground: Ground, orders: int, namespace: NewNamespace | None = None
    ) -> list[str]:
        """The interpreter itself."""
        return _interpreter(ground, orders)

    @contextlib.contextmanager
    def entry(self, spec: WorkerSpec, ground: Ground) -> Iterator[Entry]:
        """Only making what other users would run or open is given up, where the kernel has that."""
        refused = calls_refused(refusals.AT_LEAST, self.without) if refusals.has_filters() else None
        restrictions = {"user": None, "keeps_capabilities": True, "filter": refused}
        yield Entry({**restrictions, "may_gain_privileges": False})


class Held:
    """Level `restricted`: the worker stays on the host and gives up what it can of it."""

    level = Level.RESTRICTED
    has_init = False
    has_users = False

    def __init__(self, *, without: Collection[str] = (), abi: int | None = None) -> None:
        """`abi` is what is used of Landlock, if not all that the kernel has."""
        self.without = frozenset(without)
        self._abi = landlock.version() if abi is None else abi

    def ground(self, spec: WorkerSpec | None) -> Ground:
        """The interpreter, wherever it is."""
        return Ground(spec.python if spec else base_interpreter(), _ALL)

    def command(
        self, ground: Ground, orders: int, namespace: NewNamespace | None = None
    ) -> list[str]:
        """The interpreter itself."""
        return _interpreter(ground, orders)

    @contextlib.contextmanager
    def entry(self, spec: WorkerSpec, ground: Ground) -> Iterator[Entry]:
        """Files by Landlock, calls by a filter, and a separate user if the host is root."""
        has_network = "network" in spec.permissions
        groups = {
            **refusals.GROUPS,
            **refusals.WITHOUT_NAMESPACES,
            "sockets": refusals.SOCKETS_OF_THE_HOST[has_network],
        }
        user = None if "user" in self.without else user_for(spec)
        if user is None:
            groups |= refusals.WITH_THE_HOSTS_USER
            groups |= refusals.TRUNCATION if self._abi < landlock.TRUNCATES else {}
        nodes = (*(_instruments() if spec.index.devices else ()), *_nodes(spec))
        restrictions = {
            "user": user,
            "groups": sorted(_groups_of(nodes)),
            "keeps_capabilities": "capabilities" in self.without,
            "may_gain_privileges": "new privileges" in self.without,
            "filter": calls_refused(groups, self.without),
        }
        if "landlock" in self.without or not self._abi:
            yield Entry(restrictions, user=user)
            return
        with landlock.ruleset(
            readable=(*spec.site_packages, *bubblewrap.prefixes(), *_more_files(spec)),
            writable=(spec.scratch,),
            nodes=nodes,
            has_network=has_network,
            abi=self._abi,
        ) as ruleset:
            yield Entry(restrictions, ruleset=ruleset, user=user)


class Boxed:
    """Level `sandboxed`: a separate sandbox for each worker, made by bubblewrap."""

    level = Level.SANDBOXED
    has_init = True

    def __init__(
        self,
        bwrap: str,
        places: tuple[Path, ...] = (),
        *,
        has_users: bool = False,
        without: Collection[str] = (),
    ) -> None:
        """`places` are folders in which most workers' code and scratch are: a spare sees them until
        it becomes one. With `has_users`, which takes root or the helper, each worker is a
        separate user.
        """
        self._bwrap, self._places = bwrap, places
        self.has_users, self._users = has_users, Users(privileged().users)
        self.without = frozenset(without)

    def ground(self, spec: WorkerSpec | None) -> Ground:
        """Where the worker's folders are; the usual places will do if they are there."""
        if spec is None:
            return Ground(base_interpreter(), self._places)
        permissions = _CHANGES_GROUND & frozenset(spec.permissions)
        folders = (*spec.site_packages, spec.scratch)
        usual = Ground(spec.python, self._places, permissions)
        if usual.carries(spec.python, folders, permissions):
            return usual
        return Ground(spec.python, folders, permissions)

    def command(
        self, ground: Ground, orders: int, namespace: NewNamespace | None = None
    ) -> list[str]:
        """Bubblewrap, with the interpreter in it."""
        return bubblewrap.command(self._bwrap, ground, orders, namespace, without=self.without)

    @contextlib.contextmanager
    def entry(self, spec: WorkerSpec, ground: Ground) -> Iterator[Entry]:
        """Its own folders and nodes are brought in, everything outside is shut out."""
        kept = self.without
        groups = refusals.GROUPS
        if "network" in spec.permissions:  # abstract names of sockets belong to the network
            groups = {**groups, "sockets": refusals.SOCKETS_OF_THE_HOST[True]}
        mounts_too = {*kept, "mounts"}
        nodes = tuple(_nodes(spec))
        user = self._user(spec)
        given = {
            "outside": bubblewrap.OUTSIDE,
            "seen_outside": bubblewrap.seen_outside(ground),
            "hides_outside": "outside" not in kept,
            "code": [str(folder) for folder in spec.site_packages],
            "protects_code": "code" not in kept,
            "scratch": str(spec.scratch),
            "maps_scratch": user is not None and os.geteuid() != 0,
            "nodes": list(nodes),
            "shared_mb": SHARED_MB,
            "sealed": [] if "settings" in kept else bubblewrap.SEALED,
            "protected": [
                *([] if "system" in kept else bubblewrap.PROTECTED),
                *([] if "nodes" in kept else bubblewrap.NODES),
            ],
            "inotify_instances": mounts.INOTIFY_INSTANCES if "inotify" not in kept else 128,
            "is_last": "user namespaces" not in kept,
            "user": user,
            "groups": sorted(_groups_of(nodes)) if os.geteuid() == 0 else None,
            "changes_user": "user" not in kept,
            "init_filter": calls_refused(refusals.GROUPS, mounts_too),
        }
        restrictions = {
            "user": None,
            "keeps_capabilities": "capabilities" in kept,
            "may_gain_privileges": "new privileges" in kept,
            "filter": calls_refused(groups, kept),
        }
        yield Entry(restrictions, mounts=given, user=user)

    def _user(self, spec: WorkerSpec) -> int | None:
        """The worker's own, unless its code is root's alone, by the umask of who installed it."""
        if not self.has_users:
            return None
        closed = [folder for folder in spec.site_packages if not _is_listed(folder)]
        if closed:
            log.warning("%s has the host's user: only that may read %s", spec.component, closed[0])
            return None
        return self._users.of(spec.scratch)


def changes_user(confinement: Confinement) -> bool:
    """Whether workers may be other users of this machine than the host."""
    return isinstance(confinement, Held) and os.geteuid() == 0


def user_for(spec: WorkerSpec) -> int | None:
    """The user that a worker of root runs as, the same each time; None where there is none to be
    had: the host is not root, or what the worker must read is root's alone.
    """
    if os.getuid() != 0:
        return None
    needed = (*bubblewrap.prefixes(), *spec.site_packages, spec.scratch.parent)
    if not all(map(_is_open, needed)):
        return None
    return FIRST_USER + zlib.crc32(spec.component.encode()) % USERS


def _groups_of(nodes: Collection[str]) -> set[int]:
    """Groups, other than root's, that may open some of these nodes, or of those that are in these
    folders: `dialout`, `video`, …"""
    found = set()
    for node in (each for name in nodes for each in (Path(name), *Path(name).glob("*"))):
        with contextlib.suppress(OSError):
            about = node.stat()
            if about.st_mode & stat.S_IRGRP and not stat.S_ISDIR(about.st_mode):
                found.add(about.st_gid)
    return found - {0}


def _is_open(folder: Path) -> bool:
    """Whether everybody may go there and read."""
    real = folder.resolve()
    try:
        above = all(p.stat().st_mode & stat.S_IXOTH for p in real.parents)
        return above and bool(real.stat().st_mode & stat.S_IROTH)
    except OSError:
        return False


def _is_listed(folder: Path) -> bool:
    """Whether everybody who sees a folder may list it and go in."""
    return folder.stat().st_mode & _LISTED == _LISTED


def _interpreter(ground: Ground, orders: int) -> list[str]:
    python = str(ground.python)
    return [python, "-I", "-S", "-B", "-u", str(BOOTSTRAP), str(orders), str(os.getpid())]


def calls_refused(groups: Mapping[str, tuple[Rule, ...]], without: Collection[str]) -> str | None:
    """The system call filter; None where there is none to be had, or it is left out."""
    machine = refusals.machine()
    if "filter" in without or not refusals.is_known(machine):
        return None
    return base64.b64encode(refusals.filter_of(groups, machine, without=without)).decode()


def _instruments() -> Iterator[str]:
    """The machine's, as far as they are there by now, and those that the helper makes nodes for."""
    yield from _existing(INSTRUMENTS)
    yield from (place for place in bubblewrap.places_of_nodes() if place != "/dev")


def _nodes(spec: WorkerSpec) -> Iterator[str]:
    for permission in sorted(spec.permissions):
        yield from _existing(NODES.get(permission, ()))


def _more_files(spec: WorkerSpec) -> Iterator[Path]:
    if "gpu" in spec.permissions:
        yield Path("/sys")


def _existing(patterns: Collection[str]) -> Iterator[str]:
    for pattern in patterns:
        yield from sorted(map(str, Path("/").glob(pattern.lstrip("/"))))
