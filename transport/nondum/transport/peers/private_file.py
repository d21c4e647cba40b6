"""Files that only their owner may read: written whole or not at all, and refused when others can.

A file that others could read or write is not repaired: what was in it may be known already.
"""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path

from nondum.sdk.errors import Problem
from nondum.transport.peers.failures import PeerRefused

MAX_BYTES = 1 << 20
_OTHERS_READ = stat.S_IRWXG | stat.S_IRWXO
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def create(path: Path, text: str) -> None:
    """Write a new file of mode 0600; one that is there already is left alone.

    Raises `FileExistsError`, `OSError`.
    """
    staged = _staged(path, text)
    try:
        os.link(staged, path)  # unlike rename, never replaces
    finally:
        staged.unlink()
    _sync_folder(path.parent)


def replace(path: Path, text: str) -> None:
    """Write a file of mode 0600 in the place of what was there. Raises `OSError`."""
    staged = _staged(path, text)
    try:
        staged.replace(path)
    except BaseException:
        staged.unlink()
        raise
    _sync_folder(path.parent)


def read_secret(path: Path) -> str:
    """Read a file that no other user may read.

    Raises `PeerRefused` (FILE_OPEN_TO_OTHERS), `OSError`.
    """
    return _read(path, _OTHERS_READ)


def read_own(path: Path) -> str:
    """Read a file that no other user may change.

    Raises `PeerRefused` (FILE_OPEN_TO_OTHERS), `OSError`.
    """
    return _read(path, _OTHERS_WRITE)


def _read(path: Path, forbidden: int) -> str:
    with path.open("rb") as file:
        status = os.fstat(file.fileno())
        if status.st_mode & forbidden or status.st_uid not in (0, os.geteuid()):
            raise PeerRefused(_open_to_other_users(path, status))
        data = file.read(MAX_BYTES + 1)
    try:
        return data[:MAX_BYTES].decode("utf-8")
    except UnicodeDecodeError as error:
        raise PeerRefused(Problem("FILE_MALFORMED", "it is not text", where=str(path))) from error


def _open_to_other_users(path: Path, status: os.stat_result) -> Problem:
    return Problem(
        "FILE_OPEN_TO_OTHERS",
        "other users could read or change this file, so it proves nothing any more",
        where=str(path),
        need="mode 0600, own user",
        have=f"mode {stat.S_IMODE(status.st_mode):04o}, user {status.st_uid}",
        fix="make a new one, or, if no one else has used this machine, `chmod 600` it",
    )


def _staged(path: Path, text: str) -> Path:
    _make_folder(path.parent)
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)  # 0600
    staged = Path(name)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
    except BaseException:  # a full disk does not get fuller with each attempt
        staged.unlink()
        raise
    return staged


def _make_folder(folder: Path) -> None:
    """With its name on disk, and the names of those above it that were not there either."""
    if folder.is_dir():
        return
    _make_folder(folder.parent)
    folder.mkdir(exist_ok=True)
    _sync_folder(folder.parent)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
