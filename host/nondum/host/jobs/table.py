"""What a child process can be asked to do: name → blocking function of plain data.

Functions are named by module, and imported when they are wanted: a child that is started for one
job need not wait for what others import.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from nondum.sdk.frozen import frozen

Arguments = Mapping[str, Any]
Report = Callable[[str, int, int], None]
"""Phase, done, total."""
Job = Callable[[Arguments, Report], Any]

LONGEST = 16 * 1024 * 1024
"""Bytes of what is asked of a job process, and of its answer."""
PROGRESS = "progress"
"""The event that a job is so far (`Progress`)."""


@frozen
class Progress:
    """How far a job is."""

    phase: str
    done: int
    total: int


JOBS: Mapping[str, str] = {
    "look": "nondum.host.jobs.look:look",
    "copy": "nondum.host.jobs.look:copy",
    "verify": "nondum.host.jobs.look:verify",
    "hand_over": "nondum.host.jobs.parcel:hand_over",
    "outline": "nondum.host.jobs.parcel:outline",
    "judge": "nondum.host.jobs.parcel:judge",
    "install": "nondum.host.jobs.install:install",
    "compile": "nondum.host.jobs.compile:compile_wheels",
    "fill_cache": "nondum.host.jobs.cached:fill",
    "restore": "nondum.host.jobs.cached:restore",
    "prune": "nondum.host.jobs.install:prune",
    "listing": "nondum.host.jobs.install:listing",
    "sweep": "nondum.host.jobs.install:sweep",
    "without_wheels": "nondum.host.jobs.install:without_wheels",
    "found": "nondum.host.jobs.noted:found",
    "trust_load": "nondum.host.trust.chain:load",
    "trust_extend": "nondum.host.trust.chain:extend",
    "trust_judge_kept": "nondum.host.trust.chain:judge_kept",
}
"""`module:function`."""

SERVICES: Mapping[str, str] = {"bridge": "nondum.host.peers.streams.process:main"}
"""Service → `module:function`. The function runs until the process ends; its argument is the pid of
the fork server."""

AT_ONCE = ("look", "copy", "verify", "install", "restore")
"""What people wait for: a child that has time imports these before it is asked."""
ANY = "any"
"""Asks for a child that is to do any of these."""


def find(name: str) -> Job:
    """The function that does a job. Raises `KeyError`."""
    job: Job = _imported(JOBS[name])
    return job


def find_service(name: str) -> Callable[[int], None]:
    """The function that runs a service. Raises `KeyError`."""
    service: Callable[[int], None] = _imported(SERVICES[name])
    return service


def _imported(name: str) -> Any:
    module, _, function = name.partition(":")
    return getattr(import_module(module), function)
