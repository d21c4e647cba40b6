"""How much a worker has written to its scratch folder, and how that is emptied.

What is looked at was made by a stranger: links are not followed, a walk is bounded, and neither
deep folders nor files that were deleted while they are open hide anything.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import stat
from collections.abc import Collection, Iterator
from pathlib import Path

from nondum.host.sandbox.inside.open_files import BLOCK, deleted_sizes

MOST_ENTRIES = 50_000
"""Files and folders; more count as too much, whatever their size."""
FULL = 2**63
"""The size of what cannot be measured."""


def used_bytes(folder: Path, pids: Collection[int] = ()) -> int:
    """Disk that a folder takes, with deleted files in it that these processes hold open.

    Takes milliseconds for thousands of files: not for the loop.
    """
    used = 0
    held = deleted_sizes(str(folder), pids)
    for count, size in enumerate(itertools.chain(_sizes(folder), held)):
        used += size
        if count >= MOST_ENTRIES:
            return FULL
    return used


def give(folder: Path, user: int) -> None:
    """Have a folder, and all that is in it, belong to a user and its group; takes root.

    The folder is given last, and nothing is done if it is that user's. What has several names is
    left alone, since one of them may be elsewhere; what is too deep to be gone through is deleted.
    No worker may run in it meanwhile. Raises `OSError`.
    """
    if folder.stat().st_uid == user:
        return
    try:
        for _, folders, files, at in os.fwalk(folder):
            for name in (*folders, *files):
                found = os.stat(name, dir_fd=at, follow_symlinks=False)
                if stat.S_ISDIR(found.st_mode) or found.st_nlink == 1:
                    os.chown(name, user, user, dir_fd=at, follow_symlinks=False)
    except RecursionError:
        empty(folder)
    os.chown(folder, user, user)


def empty(folder: Path) -> None:
    """Delete all that is in a folder, however deep it is; nothing there is fine.

    A folder's folders are moved up before they are gone into, so that no path grows long; each is
    reached by descriptor, so that none leads out. Raises `OSError` for the first that cannot be
    deleted, such as a mount, once all others are.
    """
    names = (f".{number}" for number in itertools.count())
    stuck: dict[str, OSError] = {}
    with contextlib.suppress(FileNotFoundError), _opened(str(folder)) as top:
        while entries := sorted(set(os.listdir(top)) - stuck.keys()):  # noqa: PTH208  # of a descriptor
            for name in entries:
                try:
                    _clear(top, name, names)
                except FileNotFoundError:  # it has just gone, or something in it
                    continue
                except OSError as error:
                    stuck[name] = error
    for name, why in stuck.items():
        raise OSError(why.errno, why.strerror, str(folder / name))


def _clear(top: int, name: str, names: Iterator[str]) -> None:
    """Delete a file, or move what is in a folder up and delete that."""
    try:
        os.unlink(name, dir_fd=top)
    except IsADirectoryError:
        with _opened(name, top) as inner:
            for each in os.listdir(inner):  # noqa: PTH208  # of a descriptor
                os.rename(each, _unused(top, names), src_dir_fd=inner, dst_dir_fd=top)
        os.rmdir(name, dir_fd=top)


@contextlib.contextmanager
def _opened(name: str, at: int | None = None) -> Iterator[int]:
    """A folder, and no link to one, made readable to its owner."""
    place = os.open(name, os.O_PATH | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC, dir_fd=at)
    try:
        itself = f"/proc/self/fd/{place}"
        Path(itself).chmod(0o700)
        descriptor = os.open(itself, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    finally:
        os.close(place)
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _unused(top: int, names: Iterator[str]) -> str:
    for name in names:
        try:
            os.stat(name, dir_fd=top, follow_symlinks=False)
        except FileNotFoundError:
            return name
    raise AssertionError("names never end")


def _sizes(folder: Path) -> Iterator[int]:
    folders = [folder]
    while folders:
        try:
            with os.scandir(folders.pop()) as found_here:
                for entry in found_here:
                    with contextlib.suppress(FileNotFoundError):  # it has just gone
                        found = entry.stat(follow_symlinks=False)
                        if stat.S_ISDIR(found.st_mode):
                            folders.append(Path(entry))
                        yield found.st_blocks * BLOCK
        except FileNotFoundError:
            continue
        except OSError:  # a folder that is too deep to be named, or closed to us: it may hold much
            yield FULL
