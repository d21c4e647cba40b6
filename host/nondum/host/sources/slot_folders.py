"""What can be wrong in slot folders: links that lead nowhere, by which nothing is plugged in, and
what cannot be read, which is read again."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from nondum.sdk.errors import Problem

AGAIN_S = 1.0
"""Until what could not be read is read again."""
_GONE = (errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ELOOP)

log = logging.getLogger(__name__)


def dead_links(folder: Path) -> Iterator[Path]:
    """Those in a folder, by name. Raises `OSError` for a folder that cannot be read."""
    for entry in sorted(os.scandir(folder), key=lambda entry: entry.name):
        if entry.is_symlink() and not entry.name.startswith("."):
            try:
                entry.stat()
            except OSError as error:
                if is_gone(error):
                    yield Path(entry.path)


def leads_nowhere(link: Path) -> Problem:
    """The problem to show for such a link. Raises `OSError` if it has just gone."""
    target = link.readlink()
    told = f"it is a link to {target}, and nothing is there"
    if not target.is_absolute():
        told = f"it is a link to {target}, which means {link.parent / target}; nothing is there"
    fix = f"link to the whole path: ln -sfn /…/{target.name} {link}"
    return Problem("SLOT_DANGLING", told, where=str(link), fix=fix)


def is_gone(error: OSError) -> bool:
    """Whether nothing is there, rather than something that cannot be read now."""
    return error.errno in _GONE


def unreadable(path: Path, error: OSError, *, is_plugged_in: bool) -> Problem:
    """The problem to show for a folder, or an entry of it, that cannot be read."""
    stays = "; what was plugged in by it stays plugged in" if is_plugged_in else ""
    return Problem(
        "SLOT_UNREADABLE",
        f"cannot be read: {error.strerror}{stays}",
        where=str(path),
        fix="find out why the host cannot read it; it is read again every second",
    )


def logged(before: Mapping[Path, Problem], now: dict[Path, Problem]) -> dict[Path, Problem]:
    """Log what was not a problem before; give those of now."""
    for path, problem in now.items():
        if before.get(path) != problem:
            log.warning("%s", problem)
    return now


async def changed_or_due(changed: asyncio.Event, *, is_unread: bool) -> None:
    """Wait until something has changed, or until what could not be read is due again."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(AGAIN_S if is_unread else None):
            await changed.wait()
