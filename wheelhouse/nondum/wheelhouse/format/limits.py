"""What the worker of one component may use: as a manifest asks, and as a role or a host allows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.tables import Table

KINDS = {
    "memory_mb": "MB of memory",
    "tasks": "processes and threads",
    "numeric_threads": "threads of each numeric library",
    "startup_s": "seconds to start",
    "scratch_mb": "MB of disk for its scratch folder",
}
"""Each limit by its key, and in words after its number."""


@frozen
class WorkerLimits:
    """Some limits of a worker; None: nothing is asked, or no bound is set.

    >>> WorkerLimits(memory_mb=600).given()
    {'memory_mb': 600}
    """

    memory_mb: int | None = None
    tasks: int | None = None
    numeric_threads: int | None = None
    startup_s: int | None = None
    scratch_mb: int | None = None

    def given(self) -> dict[str, int]:
        """Those that are set, by their keys."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {key: value for key, value in values.items() if value is not None}

    def beyond(self, most: WorkerLimits) -> Iterator[tuple[str, int, int]]:
        """Key, what is asked and what is allowed, of each that is above its bound.

        >>> list(WorkerLimits(memory_mb=600, tasks=9).beyond(WorkerLimits(memory_mb=500, tasks=9)))
        [('memory_mb', 600, 500)]
        """
        bounds = most.given()
        for key, asked in self.given().items():
            if key in bounds and asked > bounds[key]:
                yield key, asked, bounds[key]


def parse(table: Table | None) -> WorkerLimits:
    """Read a table of limits, and close it; 0 is as if it were left out."""
    if table is None:
        return WorkerLimits()
    found = {key: table.integer(key, 0) or None for key in KINDS}
    table.close()
    return WorkerLimits(**found)


def not_granted(
    component: str, asked: WorkerLimits, most: WorkerLimits, by: str, fix: str
) -> Iterator[Problem]:
    """LIMIT_NOT_GRANTED for each limit of a component that is above what `by` allows; `fix` has a
    place for the key."""
    for key, wanted, allowed in asked.beyond(most):
        kind = KINDS[key]
        yield Problem(
            "LIMIT_NOT_GRANTED",
            f"the component asks for {wanted} {kind}, which {by} does not allow",
            where=f"{component}: {key}",
            need=f"{wanted} {kind}",
            have=f"at most {allowed}",
            fix=fix.format(key=key),
        )
