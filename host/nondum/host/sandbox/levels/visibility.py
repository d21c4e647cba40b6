"""What a confined process has seen of the host, and whether that is too much. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from nondum.host.config.confinement_level import Finding
from nondum.host.sandbox.levels.users import is_workers
from nondum.wheelhouse.format.confinement import Level

MOST_PROCESSES = 3
"""In its own sandbox a worker sees its init, itself, and no more."""
_FIXES: Mapping[Level, str] = {
    Level.SANDBOXED: "allow bubblewrap user namespaces (`sysctl"
    " kernel.unprivileged_userns_clone=1`; with AppArmor, a profile for bwrap), or run the service"
    " as nondum's package sets it up",
    Level.RESTRICTED: "use a kernel with Landlock (5.13, `lsm=landlock,…` among its parameters)",
}
MISSING = Finding(
    Level.SANDBOXED,
    is_available=False,
    reason="bubblewrap is not installed",
    fix="apt install bubblewrap",
)


def judged(level: Level, seen: Mapping[str, Any]) -> Finding:
    """Whether what was seen from within is what the level promises.

    >>> judged(Level.RESTRICTED, {"capabilities": 1, "sees_state": True}).reason.partition(",")[0]
    'in it a process still holds capabilities'
    """
    holes = [hole for hole, is_open in _holes(level, seen) if is_open]
    if holes:
        reason = f"in it a process still {', '.join(holes)}"
        return Finding(level, is_available=False, reason=reason, fix=_FIXES[level])
    lacks = "processes of the same user can be signalled" if seen["signals_host"] else ""
    has_users = level is Level.SANDBOXED and is_workers(seen["user"])
    return Finding(level, is_available=True, reason=lacks, has_users=has_users)


def sharing(finding: Finding, why: str) -> Finding:
    """The same, if it can be had, of workers that share a user, with why they do."""
    if not finding.is_available:
        return finding
    return replace(finding, reason=f"workers share a user, and its limits, since {why}")


def failed(level: Level, why: str) -> Finding:
    """It could not be tried out."""
    return Finding(level, is_available=False, reason=why, fix=_FIXES[level])


def _holes(level: Level, seen: Mapping[str, Any]) -> Iterator[tuple[str, bool]]:
    yield "holds capabilities", bool(seen.get("capabilities", True))
    yield "may gain privileges", not seen.get("no_new_privileges")
    yield "has all system calls", not seen.get("filters")
    yield "lacks its own library", not seen.get("sees_library")
    yield "reads the host's files", bool(seen.get("sees_state", True))
    yield "writes to the system", bool(seen.get("writes_system", True))
    yield "makes namespaces", bool(seen.get("makes_namespaces", True))
    if level is Level.SANDBOXED:
        yield "sees other processes", seen.get("processes", MOST_PROCESSES + 1) > MOST_PROCESSES
        yield "has a network", bool(set(seen.get("interfaces", ["?"])) - {"lo"})
