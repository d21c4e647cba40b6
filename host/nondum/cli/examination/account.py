"""Who runs nondum, and what that user may open."""

from __future__ import annotations

import grp
import os
import pwd
from collections.abc import Collection, Iterator
from contextlib import suppress

from nondum.cli.examination.finding import Finding, ok, warn
from nondum.host.config.host_config import HostConfig

SERVICE_USER = "nondum"
USEFUL = ("dialout", "video", "audio", "input", "i2c", "plugdev")
"""Groups by which Debian lets people open devices."""


def examine(config: HostConfig) -> Iterator[Finding]:
    """Look at users and groups."""
    del config
    yield judge_service_user(is_there=_has_user(SERVICE_USER))
    names = set()
    for number in {os.getgid(), *os.getgroups()}:
        with suppress(KeyError):
            names.add(grp.getgrgid(number).gr_name)
    there = set()
    for name in USEFUL:
        with suppress(KeyError):
            there.add(grp.getgrnam(name).gr_name)
    yield judge_groups(os.geteuid(), names, there)


def judge_service_user(*, is_there: bool) -> Finding:
    """Whether the service has its user. Pure."""
    if is_there:
        return ok("user", f"the service has its user, {SERVICE_USER}")
    fix = "install the package, or run `systemd-sysusers` with packaging/sysusers.d/nondum.conf"
    return warn("user", f"there is no user {SERVICE_USER}: nondum runs with --user only", fix)


def judge_groups(uid: int, names: Collection[str], there: Collection[str]) -> Finding:
    """Which devices the one who asks could open without the helper. Pure."""
    if uid == 0:
        return ok("groups", "asked by root, who may open everything")
    missing = [name for name in USEFUL if name in there and name not in names]
    if not missing:
        return ok("groups", "this user is in all groups that devices belong to")
    told = f"this user is not in {', '.join(missing)}; the service needs none, `--user` does"
    return warn("groups", told, f"`usermod -aG {','.join(missing)} USER`, where --user is used")


def _has_user(name: str) -> bool:
    try:
        pwd.getpwnam(name)
    except KeyError:
        return False
    return True
