"""Level `none`: a worker that is held by nothing but limits."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator

from nondum.host.sandbox.levels import refusals
from nondum.host.sandbox.levels.bubblewrap import Ground
from nondum.host.sandbox.levels.users import NewNamespace
from nondum.host.workers.confinement import EVERYWHERE, Entry, calls_refused, interpreter_command
from nondum.host.workers.spec import WorkerSpec, base_interpreter
from nondum.wheelhouse.format.confinement import Level


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
        return Ground(spec.python if spec else base_interpreter(), EVERYWHERE)

    def command(
        self, ground: Ground, orders: int, namespace: NewNamespace | None = None
    ) -> list[str]:
        """The interpreter itself."""
        return interpreter_command(ground, orders)

    @contextlib.contextmanager
    def entry(self, spec: WorkerSpec, ground: Ground) -> Iterator[Entry]:
        """Only making what other users would run or open is given up, where the kernel has that."""
        refused = calls_refused(refusals.AT_LEAST, self.without) if refusals.has_filters() else None
        restrictions = {"user": None, "keeps_capabilities": True, "filter": refused}
        yield Entry({**restrictions, "may_gain_privileges": False})
