"""Checks of the disk space for payloads and for the state of the host."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from nondum.cli.examination.finding import Finding, bad, ok, warn
from nondum.host.config.host_config import HostConfig

MEGABYTE = 1 << 20


def examine(config: HostConfig) -> Iterator[Finding]:
    """Look at the state folder, and at the disk that it is on."""
    state = config.host.state
    there = next(one for one in (state, *state.parents) if one.exists())
    yield judge_folder(state, is_there=there == state, may_write=os.access(there, os.W_OK))
    try:
        free_mb = shutil.disk_usage(there).free // MEGABYTE
    except OSError as error:
        yield bad("disk", f"{there} cannot be looked at ({error})", "see to it that the disk works")
        return
    yield judge_free(free_mb, config.install.reserve_mb, config.install.quota_mb)


def judge_folder(state: Path, *, is_there: bool, may_write: bool) -> Finding:
    """Whether what the host knows can be kept, by the one who asks. Pure."""
    if is_there and may_write:
        return ok("state", f"{state} is there, and may be written")
    if may_write:
        return ok("state", f"{state} is not there yet, and can be made")
    told = f"{state} {'may not be written' if is_there else 'cannot be made'} by this user"
    fix = "ask as the user that runs the daemon, or see `state` under [host]"
    return warn("state", told, fix)


def judge_free(free_mb: int, reserve_mb: int, quota_mb: int) -> Finding:
    """Whether there is space for payloads. Pure."""
    if free_mb <= reserve_mb:
        told = f"{free_mb} MB are free, and {reserve_mb} MB stay free whatever is plugged in"
        return bad("disk", told, "free some space: no payload is installed until then")
    if free_mb < reserve_mb + quota_mb // 4:
        told = f"{free_mb} MB are free, of which {reserve_mb} MB are reserved; wheels may need more"
        fix = f"free some space, or lower `quota_mb` ({quota_mb}) under [install]"
        return warn("disk", told, fix)
    return ok("disk", f"{free_mb} MB are free, of which {reserve_mb} MB are reserved")
