"""Whom this host believes, what plans for it, and what it was told to be."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from importlib.metadata import entry_points
from pathlib import Path

from nondum.host.config import HostConfig
from nondum.host.doctor.finding import Finding, bad, ok, warn
from nondum.host.mind.planners import GROUP
from nondum.sdk.errors import NondumError
from nondum.wheelhouse.trust.trust_file import parse_bytes


def examine(config: HostConfig) -> Iterator[Finding]:
    """Look at trust, keys and planners."""
    allows = config.drives.allow_unsigned
    yield trust(config.trust.file or config.host.state / "trust.toml", allow_unsigned=allows)
    if config.peers.enabled:
        yield judge_key(config.host.state / "peers")
    yield judge_planners(sorted(entry.name for entry in entry_points(group=GROUP)))


def trust(path: Path, *, allow_unsigned: bool) -> Finding:
    """Whether there is a trust file, and whether it is one."""
    if allow_unsigned:
        told = "payloads without a signature are taken (`drives.allow_unsigned`)"
        return warn("trust", told, "for development only: make keys with `nondum keys`")
    try:
        parse_bytes(path.read_bytes(), str(path))
    except FileNotFoundError:
        told = f"there is no {path}: no payload is taken"
        return bad("trust", told, "make one with `nondum keys`, see docs/trust.md")
    except PermissionError:
        return ok("trust", f"{path} is there, and not for this user to read")
    except OSError as error:
        return bad("trust", f"{path} cannot be read ({error.strerror})", "look at its permissions")
    except NondumError as error:
        return bad("trust", str(error), "correct it, or make another with `nondum keys`")
    return ok("trust", f"{path} says whose payloads are taken")


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
    return bad("planner", told, "install nondum anew, with its planners")
