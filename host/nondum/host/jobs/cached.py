"""Payloads that were withdrawn and may come back: their venvs are made for them ahead, in a child
process, and used if the drive brings the same list and they were not touched since."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nondum.host.jobs import install, look
from nondum.host.jobs.table import Arguments, Report
from nondum.sdk.codec.values import to_plain


def fill(arguments: Arguments, report: Report) -> dict[str, Any]:
    """Make the venvs of a payload again, from what the store has once it is hashed again: their
    `stamp`, and whether they are `uncompiled`.

    Its checked files are in `folder`. Raises `InstallFailed` (STORE_DAMAGED, DISK_FULL, …).
    """
    folder, venvs = Path(arguments["folder"]), Path(arguments["venvs"])
    staged = look.load_staged(folder)
    venvs.mkdir(exist_ok=True)
    facts = look.facts_of(arguments)
    _, uncompiled = install.make_venvs(arguments, staged, facts, report)
    return {"stamp": _stamp(folder, venvs), "uncompiled": uncompiled}


def restore(arguments: Arguments, report: Report) -> dict[str, Any] | None:
    """Judge a payload that is in the cache as one that is copied: its `grant`, the `gpu` that this
    host has, the bytes that need not be copied. None: the files are not as they were.

    Raises `PayloadRefused`, `DriveGone`.
    """
    folder, venvs = Path(arguments["cached_folder"]), Path(arguments["cached_venvs"])
    judged = look.judged_again(arguments)
    if _stamp(folder, venvs) != arguments["stamp"]:
        return None
    staged = look.load_staged(folder)
    facts = look.admitted(arguments, judged, staged)
    judged.keep_signature(folder)
    return {
        "grant": judged.grant.to_dict(),
        "gpu": to_plain(facts.memory.gpu),
        "known": sum(locked.size for locked in look.chosen(staged, facts)),
    }


def _stamp(*roots: Path) -> str:
    """A digest of what stat(2) tells of everything there: as git's index, it shows what has been
    written since without reading it. The time of an inode's change is left out: links to the store
    come and go."""
    digest = hashlib.sha256()
    for root in roots:
        for path, status in _entries(root):
            seen = (path, status.st_mode, status.st_ino, status.st_size, status.st_mtime_ns)
            digest.update(repr(seen).encode())
    return digest.hexdigest()


def _entries(root: Path) -> Iterator[tuple[str, os.stat_result]]:
    """Path and status of each file, link and folder, always in the same order."""
    folders = [str(root)]
    while folders:
        with os.scandir(folders.pop()) as found:
            entries = sorted(found, key=lambda entry: entry.name)
        for entry in entries:
            yield os.path.relpath(entry.path, root), entry.stat(follow_symlinks=False)
        folders += [entry.path for entry in entries if entry.is_dir(follow_symlinks=False)]
