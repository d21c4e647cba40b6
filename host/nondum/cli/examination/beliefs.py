"""Checks of the trust file, the keys and the planners of this host."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from importlib.metadata import entry_points
from pathlib import Path

from nondum.cli.examination.finding import Finding, bad, ok, warn
from nondum.host.config.host_config import HostConfig
from nondum.host.mind.extension import GROUP
from nondum.host.trust import anchors
from nondum.sdk.errors import NondumError


def examine(config: HostConfig) -> Iterator[Finding]:
    """Look at trust, keys and planners."""
    allows = config.drives.allow_unsigned
    yield trust(config.first_trust_file, allow_unsigned=allows)
    if config.peers.enabled:
        yield judge_key(config.host.state / "peers")
    yield judge_planners(sorted(entry.name for entry in entry_points(group=GROUP)))


def trust(path: Path, *, allow_unsigned: bool) -> Finding:
    """Whether there is a trust file, and whether it is one."""
    if allow_unsigned:
        told = "payloads without a signature are taken (`drives.allow_unsigned`)"
        return warn("trust", told, "for development only: make keys with `nondum keys`")
    if _is_closed(path):
        return ok("trust", f"{path} is there, and not for this user to read")
    try:
        anchor = anchors.load(path)
    except NondumError as error:
        if error.code == "TRUST_MISSING":
            told = f"there is no {path}: no payload is taken"
            return bad("trust", told, "make one with `nondum keys`, see docs/trust.md")
        fix = error.problems[0].fix or "correct it, or make another with `nondum keys`"
        return bad("trust", str(error), fix)
    return ok("trust", f"{path} says whose payloads are taken ({anchor.origin.value})")


def _is_closed(path: Path) -> bool:
    """Whether this user may not read the file, or not look into its folder."""
    try:
        path.stat()
    except PermissionError:
        return True
    except OSError:
        return False
    return not os.access(path, os.R_OK)


def judge_key(folder: Path) -> Finding:
    """Whether this host has a key, by which others know it."""
    try:
        has_key = any(folder.iterdir())
    except PermissionError:
        return ok("keys", f"{folder} is not for this user to see")
    except OSError:
        has_key = False
    if has_key:
        return ok("keys", f"this host's key is in {folder}")
    return ok("keys", "this host has no key yet: it makes one when it starts")


def judge_planners(names: Collection[str]) -> Finding:
    """Whether anything plans. Pure."""
    if names:
        return ok("planner", ", ".join(names))
    told = "no planner is installed: no goal has a plan"
    return bad("planner", told, "install nondum again, with its planners")
