"""Symbolic links in slot folders that lead nowhere: nothing is plugged in by them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from nondum.sdk.errors import Problem


def dead_links(folder: Path) -> Iterator[Path]:
    """Those in a folder, by name. Raises `OSError` for a folder that cannot be read."""
    for entry in sorted(os.scandir(folder), key=lambda entry: entry.name):
        if entry.is_symlink() and not entry.name.startswith("."):
            try:
                entry.stat()
            except OSError:
                yield Path(entry.path)


def leads_nowhere(link: Path) -> Problem:
    """What people are told of one. Raises `OSError` if it has just gone."""
    target = link.readlink()
    told = f"it is a link to {target}, and nothing is there"
    if not target.is_absolute():
        told = f"it is a link to {target}, which means {link.parent / target}; nothing is there"
    fix = f"link to the whole path: ln -sfn /…/{target.name} {link}"
    return Problem("SLOT_DANGLING", told, where=str(link), fix=fix)
