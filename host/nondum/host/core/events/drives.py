"""Drives come, are read, and go."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from nondum.host.core.events.event import Event
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class DriveInserted(Event):
    """A drive is there: a slot's entry or a block device."""

    drive: str
    """Name of this insertion: `slot-a`, `sdb1`."""
    root: Path
    """Where its files are, or will be once `node` is mounted there."""
    kind: str
    """`slot`, `block`, `installed` or `placed`."""
    node: Path | None = None
    """The block device to mount at `root`; None: `root` is readable as it is."""
    filesystem: str = ""
    """File system of `node`, as udev names it."""
    problems: tuple[Problem, ...] = ()
    """What keeps it from being read at all."""
    port: str = ""
    """Where it is plugged in, as far as that is known: whatever comes there next has the same."""
    mark: str = ""
    """What it says that it is, the same after the machine has started again; empty: nothing."""


@frozen
class DriveQueued(Event):
    """A drive waits until others have been looked through."""

    JOURNALLED: ClassVar[bool] = False
    drive: str
    ahead: int
    """How many come before it; 0: its turn has come."""


@frozen
class DriveFlapping(Event):
    """Something comes and goes in a port, so that it is not read before it has stayed a while."""

    drive: str
    problems: tuple[Problem, ...]


@frozen
class DriveLeftAlone(Event):
    """A disk that could be plugged in is this machine's own: it is never read."""

    drive: str
    problems: tuple[Problem, ...]


@frozen
class DriveRemoved(Event):
    """A drive was pulled, or its source says that it is not there."""

    drive: str


@frozen
class DriveRead(Event):
    """A drive has been looked through; `payloads` (keys) are all that it carries."""

    drive: str
    payloads: tuple[str, ...]
    certificates: int = 0
    """How many certificates of hosts it carries."""
    trust_files: int = 0
    """How many versions of trust files it carries."""
    flaws: tuple[Problem, ...] = ()
    """What is on it, and is not taken."""


@frozen
class DriveReleased(Event):
    """A drive was let go of: nothing of it is mounted, and nothing is read from it."""

    JOURNALLED: ClassVar[bool] = False
    drive: str


@frozen
class DriveUnreadable(Event):
    """A drive could not be mounted or looked through, or carries no payload."""

    drive: str
    problems: tuple[Problem, ...]


@frozen
class DrivesScanned(Event):
    """The source of one kind of drives has told every drive that was there when it started."""

    kind: str
    drives: tuple[str, ...]


@frozen
class DriveRetried(Event):
    """A drive that was left alone is to be looked at: a person asked for it, or the host does by
    itself."""

    drive: str
    why: str = ""
    """Why the host does; empty: a person asked."""
