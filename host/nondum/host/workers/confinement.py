"""What every level of confinement has: how an interpreter is started, and becomes a worker."""

from __future__ import annotations

import base64
import os
from collections.abc import Collection, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Protocol

from nondum.host.sandbox.levels import bubblewrap, refusals
from nondum.host.sandbox.levels.bubblewrap import Ground
from nondum.host.sandbox.levels.filters import Rule
from nondum.host.sandbox.levels.users import NewNamespace
from nondum.host.workers.spec import WorkerSpec
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.confinement import Level

BOOTSTRAP = bubblewrap.INSIDE / "bootstrap.py"
EVERYWHERE = (Path("/"),)


@frozen
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


def calls_refused(groups: Mapping[str, tuple[Rule, ...]], without: Collection[str]) -> str | None:
    """The system call filter; None where there is none to be had, or it is left out."""
    machine = refusals.machine()
    if "filter" in without or not refusals.is_known(machine):
        return None
    return base64.b64encode(refusals.filter_of(groups, machine, without=without)).decode()


def interpreter_command(ground: Ground, orders: int) -> list[str]:
    """The command that starts an interpreter as it is; `orders` is the descriptor that it hears
    at."""
    python = str(ground.python)
    return [python, "-I", "-S", "-B", "-u", str(BOOTSTRAP), str(orders), str(os.getpid())]
