"""The files of a cgroup, and the folder itself."""

from __future__ import annotations

import contextlib
import errno
import os
import signal
from pathlib import Path

ROUNDS = 100
"""How often a cgroup that forks is gone through at most."""


def number(file: Path) -> int:
    """The number in a file; 0 where there is none."""
    try:
        return int(file.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return 0


def numbers(file: Path) -> dict[str, int]:
    """The numbers in a file of lines `key number`; none where it is not there."""
    try:
        lines = file.read_text(encoding="ascii").splitlines()
    except OSError:
        return {}
    pairs = (line.split() for line in lines)
    return {pair[0]: int(pair[1]) for pair in pairs if len(pair) == 2 and pair[1].isdigit()}


def words(file: Path) -> frozenset[str]:
    """The words in a file; none where it is not there."""
    try:
        return frozenset(file.read_text(encoding="ascii").split())
    except OSError:
        return frozenset()


def pids(folder: Path) -> tuple[int, ...]:
    """The processes in a cgroup; none once it is gone."""
    return tuple(sorted(int(pid) for pid in words(folder / "cgroup.procs")))


def child_names(folder: Path) -> tuple[str, ...]:
    """The names of the child cgroups of a cgroup."""
    try:
        return tuple(sorted(entry.name for entry in folder.iterdir() if entry.is_dir()))
    except FileNotFoundError:
        return ()


def put(file: Path, value: str | int) -> None:
    """Write a value. Raises `OSError`."""
    # Not Path.write_text: these files are there, and must not be made where they are not.
    descriptor = os.open(file, os.O_WRONLY | os.O_CLOEXEC)
    try:
        os.write(descriptor, str(value).encode())
    finally:
        os.close(descriptor)


def kill_all(folder: Path, state: Path, stop: str, go: str) -> None:
    """Stop a cgroup by its freezer, SIGKILL everybody in it, and let them go to their end."""
    for _ in range(ROUNDS):
        held = pids(folder)
        if not held:
            return
        with contextlib.suppress(OSError):  # without a freezer it is a race, and mostly won
            put(state, stop)
        for pid in held:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        with contextlib.suppress(OSError):
            put(state, go)


def remove(folder: Path) -> bool:
    """Remove an empty cgroup; answer whether it is gone. Raises `OSError`."""
    try:
        folder.rmdir()
    except FileNotFoundError:
        return True
    except OSError as error:
        if error.errno != errno.EBUSY:
            raise
        return False
    return True
