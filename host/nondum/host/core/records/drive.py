"""Drives that are in."""

from __future__ import annotations

from enum import Enum
from pathlib import Path

from nondum.host.core.records.moment import UNKNOWN_MOMENT, Moment
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

INSTALLED = "installed"
"""Kind of the drives that stand for initial components: no source watches them."""


class DriveState(Enum):
    """How far a drive has been read."""

    READING = "reading"
    """It is being looked through."""
    COPYING = "copying"
    """All its payloads are known; some are still being copied."""
    IDLE = "idle"
    """Nothing is wanted of it any more; it is unmounted and safe to pull."""


@frozen
class DriveRecord:
    """A drive that is in."""

    id: str
    kind: str
    """`slot`, `block`, `installed` or `placed`."""
    root: Path
    node: Path | None = None
    """Block device to mount at `root`, where there is one."""
    filesystem: str = ""
    state: DriveState = DriveState.READING
    since: Moment = UNKNOWN_MOMENT
    """When it was inserted."""
    problems: tuple[Problem, ...] = ()
    mark: str = ""
    """What it is by its own word, whenever it is plugged in; empty: it has none."""
