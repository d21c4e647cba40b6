"""The lock on a state folder: one daemon at a time has it.

It is a POSIX lock (`F_SETLK`, fcntl(2)) on the file `lock`. A forked process does not have the
locks of its parent. So a daemon that is killed while a child of it is between fork and exec leaves
no lock behind (docs/decisions/0001-lock-of-the-state-folder.md).

The kernel drops the lock when the process ends, but also when the process closes any descriptor of
that file: no other code opens it.
"""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import logging
import os
import signal
import struct
from collections.abc import Callable
from pathlib import Path

from nondum.host.core.printable import printable
from nondum.sdk.errors import ConfigRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.store import disk

ENDING_S = 10.0
"""How long a daemon that ends is waited for."""
HEALTHY_S = 1.0
"""A daemon that shows no sign of ending for so long is not waited for. The kernel takes a moment
to show that a process was killed."""
LOOK_S = 0.05
"""Between two attempts."""

_OWNED, _RUNS = 0, 1
"""Bytes of the file that are locked: the first as long as the daemon's process is there, the second
until it begins to end."""
_FLOCK = "hhqqi0q"
"""struct flock: l_type, l_whence, l_start, l_len, l_pid."""
_PF_EXITING = 0x4
_SIGKILL = 1 << (signal.SIGKILL - 1)

_ours: set[tuple[int, int]] = set()
"""Device and inode of each file that this process has locked: locks of one process never conflict,
and opening such a file again would drop its lock."""

log = logging.getLogger(__name__)


@frozen
class Holder:
    """The process that has the lock."""

    pid: int
    """0 if it runs in another container."""
    name: str
    is_ending: bool

    def __str__(self) -> str:
        return f"process {self.pid} ({self.name})" if self.pid else "a process in another container"


class StateLock:
    """A lock that this process has. `release` it."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._file = _identity(os.fstat(descriptor))
        _ours.add(self._file)

    def will_end(self) -> None:
        """Show that this daemon is ending: the next one waits for it, and does not give up."""
        fcntl.lockf(self._descriptor, fcntl.LOCK_UN, 1, _RUNS)

    def release(self) -> None:
        """Let another daemon have the state folder."""
        os.close(self._descriptor)
        _ours.discard(self._file)


async def lock(root: Path, on_wait: Callable[[str], None] = lambda words: None) -> StateLock:
    """Lock a state folder for this daemon; it is made if it is not there.

    A daemon that is ending is waited for; `on_wait` is called with what is waited for. Raises
    `ConfigRefused` (ALREADY_RUNNING, STATE_BUSY, STATE_UNWRITABLE).
    """
    loop = asyncio.get_running_loop()
    begun_s = healthy_s = loop.time()
    waited_for: Holder | None = None
    while isinstance(found := attempt(root), Holder):
        if found.is_ending:
            healthy_s = loop.time()
        if loop.time() >= healthy_s + HEALTHY_S:
            raise ConfigRefused(_running(root, found))
        if loop.time() >= begun_s + ENDING_S:
            raise ConfigRefused(_busy(root, found))
        if found.is_ending and (waited_for is None or found.pid != waited_for.pid):
            waited_for = found
            words = f"waiting for {found} to end: it still uses {root}"
            log.warning("%s", words)
            on_wait(words)
        await asyncio.sleep(LOOK_S)
    if waited_for is not None:
        log.info("%s has ended after %.1f s", waited_for, loop.time() - begun_s)
    return found


def attempt(root: Path) -> StateLock | Holder:
    """Lock the folder, or tell which process has it. Raises `ConfigRefused` (STATE_UNWRITABLE)."""
    file = root / "lock"
    try:
        disk.make_folder(root)
        with contextlib.suppress(FileNotFoundError):
            if _identity(file.stat()) in _ours:
                return _holder(os.getpid(), runs=True)
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise ConfigRefused(_unwritable(root, error)) from error
    try:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB, 2, _OWNED)  # both at once
    except BlockingIOError:
        pid = _pid_with(descriptor, _OWNED)
        runs = _pid_with(descriptor, _RUNS) is not None
        os.close(descriptor)
        return attempt(root) if pid is None else _holder(pid, runs=runs)
    except OSError as error:
        os.close(descriptor)
        raise ConfigRefused(_unwritable(root, error)) from error
    return StateLock(descriptor)


def _identity(found: os.stat_result) -> tuple[int, int]:
    return found.st_dev, found.st_ino


def _pid_with(descriptor: int, byte: int) -> int | None:
    """The process that has locked a byte; None: none has. Not positive: it is out of sight."""
    asked = struct.pack(_FLOCK, fcntl.F_WRLCK, os.SEEK_SET, byte, 1, 0)
    answer = struct.unpack(_FLOCK, fcntl.fcntl(descriptor, fcntl.F_GETLK, asked))
    return None if answer[0] == fcntl.F_UNLCK else max(answer[-1], 0)


def _holder(pid: int, *, runs: bool) -> Holder:
    name = ""
    with contextlib.suppress(OSError):
        name = Path(f"/proc/{pid}/comm").read_text(encoding="utf-8", errors="replace").strip()
    return Holder(pid, printable(name), is_ending=not runs or is_dying(pid))


def is_dying(pid: int) -> bool:
    """Whether a process was killed, and has not ended yet (proc_pid_stat(5))."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
        status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8", errors="replace")
    except OSError:  # it has just ended, or is hidden
        return False
    state, *fields = stat.rpartition(")")[2].split()
    pending = [line.split()[1] for line in status.splitlines() if line[:6] in ("SigPnd", "ShdPnd")]
    return (
        state in "ZX"
        or bool(int(fields[5]) & _PF_EXITING)
        or any(int(signals, 16) & _SIGKILL for signals in pending)
    )


def _running(root: Path, holder: Holder) -> Problem:
    return Problem(
        "ALREADY_RUNNING",
        f"another daemon uses this state folder: {holder}",
        where=str(root),
        fix="stop that one, or give this host another `state` folder",
    )


def _busy(root: Path, holder: Holder) -> Problem:
    return Problem(
        "STATE_BUSY",
        f"the daemon before this one is ending, and still uses this state folder: {holder}",
        where=str(root),
        need=f"it ends within {ENDING_S:g} s",
        fix=f"end it (`kill -9 {holder.pid or 'PID'}`) and start again; if it does not end, a drive"
        " or disk does not answer: unplug it, or restart the computer",
    )


def _unwritable(root: Path, error: OSError) -> Problem:
    return Problem(
        "STATE_UNWRITABLE",
        f"the state folder cannot be used ({error.strerror})",
        where=str(root),
        fix="see to it that the disk works and is not read-only, or give another `state` folder",
    )
