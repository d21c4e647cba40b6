"""One daemon at a time uses a state folder, and one that is started again at once gets it.

The daemons here are processes that do nothing but hold the lock. Time is virtual.
"""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from tests.faults.fuse import served
from tests.kit.clock import VirtualClock
from tests.kit.golden import Golden
from tests.kit.until import until

from nondum.host.manager import state_lock
from nondum.host.manager.state_lock import ENDING_S, HEALTHY_S, LOOK_S, Holder, StateLock
from nondum.sdk.errors import ConfigRefused

pytestmark = pytest.mark.anyio

HOLDER = """
import os, signal, subprocess, sys, threading
from pathlib import Path
from nondum.host.manager import state_lock

def tell(words):
    os.write(1, f"{words}\\n".encode())

def before_exec():
    tell(os.getpid())
    signal.pause()

held = state_lock.attempt(Path(sys.argv[1]))
tell(repr(held))
for line in sys.stdin:
    match line.split():
        case ["end"]:
            held.will_end()
            tell("ending")
        case ["start", "child"]:
            subprocess.Popen(["true"], preexec_fn=before_exec)
        case ["read", file]:
            threading.Thread(target=Path(file).read_bytes).start()
"""


class Daemon:
    """Another process that has the lock, or was told which one has it."""

    def __init__(self, state: Path, *unshare: str) -> None:
        self.process = subprocess.Popen(
            [*unshare, sys.executable, "-c", HOLDER, str(state)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.found = self.hear()

    @property
    def name(self) -> str:
        return f"process {self.process.pid} ({Path(sys.executable).name})"

    def hear(self) -> str:
        assert self.process.stdout is not None  # it is a pipe
        return self.process.stdout.readline().strip()

    def tell(self, order: str) -> None:
        assert self.process.stdin is not None  # it is a pipe
        self.process.stdin.write(f"{order}\n")
        self.process.stdin.flush()

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()


@contextmanager
def daemon(state: Path, *unshare: str) -> Iterator[Daemon]:
    held = Daemon(state, *unshare)
    with held.process:
        try:
            yield held
        finally:
            held.process.kill()


def open_files(pid: int) -> list[Path]:
    return [descriptor.readlink() for descriptor in Path(f"/proc/{pid}/fd").iterdir()]


async def locked_at_once(state: Path, clock: VirtualClock) -> StateLock:
    locking = asyncio.create_task(state_lock.lock(state))
    await clock.settle()
    assert locking.done(), "it waits for something"
    return await locking


async def refused(locking: asyncio.Task[StateLock], code: str) -> str:
    assert locking.done(), "it still waits"
    with pytest.raises(ConfigRefused) as found:
        await locking
    assert found.value.code == code
    return str(found.value)


async def test_daemon_that_runs_keeps_a_second_one_out(tmp_path: Path, clock: VirtualClock) -> None:
    with daemon(tmp_path) as running:
        locking = asyncio.create_task(state_lock.lock(tmp_path))
        await clock.advance(HEALTHY_S + LOOK_S)
        assert running.name in await refused(locking, "ALREADY_RUNNING")


async def test_daemon_that_was_killed_has_no_lock(tmp_path: Path, clock: VirtualClock) -> None:
    with daemon(tmp_path) as killed:
        killed.kill()
        (await locked_at_once(tmp_path, clock)).release()


async def test_child_that_has_not_executed_yet_has_no_lock(
    tmp_path: Path, clock: VirtualClock
) -> None:
    """A daemon is killed while a child of it is between fork and exec."""
    with daemon(tmp_path) as killed:
        killed.tell("start child")
        child = int(killed.hear())
        try:
            killed.kill()
            assert tmp_path / "lock" in open_files(child), (
                "it has inherited what a lock is taken by"
            )
            (await locked_at_once(tmp_path, clock)).release()
        finally:
            os.kill(child, signal.SIGKILL)


async def test_daemon_that_ends_is_waited_for_and_named(
    tmp_path: Path, clock: VirtualClock, golden: Golden
) -> None:
    waited: list[str] = []
    with daemon(tmp_path) as ending:
        ending.tell("end")
        assert ending.hear() == "ending"
        locking = asyncio.create_task(state_lock.lock(tmp_path, waited.append))
        await clock.advance(ENDING_S / 2)
        [said] = waited
        golden.check("another daemon is ending", said, daemon=ending.name, state=tmp_path)
        assert not locking.done()
        ending.kill()
        await clock.advance(LOOK_S)
        (await locking).release()


async def test_daemon_that_never_ends_is_not_waited_for_longer_than_promised(
    tmp_path: Path, clock: VirtualClock
) -> None:
    with daemon(tmp_path) as ending:
        ending.tell("end")
        assert ending.hear() == "ending"
        locking = asyncio.create_task(state_lock.lock(tmp_path))
        await clock.advance(ENDING_S - LOOK_S)
        assert not locking.done()
        await clock.advance(2 * LOOK_S)
        said = await refused(locking, "STATE_BUSY")
        assert ending.name in said
        assert f"kill -9 {ending.process.pid}" in said


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting needs root")
async def test_daemon_that_was_killed_and_hangs_in_a_drive_is_waited_for(
    tmp_path: Path, clock: VirtualClock
) -> None:
    """The kernel ends a process only when its drive has answered."""
    (tmp_path / "drive").mkdir()
    (tmp_path / "drive/file").write_bytes(b"slow")
    answers, asked = threading.Event(), threading.Event()

    def answer(opening: int, offset: int, size: int) -> bytes:
        asked.set()
        answers.wait()
        return b""

    with served(tmp_path / "drive", tmp_path / "mount") as drive, daemon(tmp_path) as hanging:
        drive.answers["file"] = answer
        hanging.tell(f"read {tmp_path}/mount/file")
        try:
            await asyncio.to_thread(asked.wait)
            hanging.process.send_signal(signal.SIGKILL)
            locking = asyncio.create_task(state_lock.lock(tmp_path))
            await clock.advance(ENDING_S / 2)
            assert not locking.done()
        finally:
            answers.set()
        hanging.process.wait()
        await clock.advance(LOOK_S)
        (await locking).release()


async def test_process_locks_a_folder_once_and_keeps_the_lock(
    tmp_path: Path, clock: VirtualClock
) -> None:
    held = await locked_at_once(tmp_path, clock)
    again = asyncio.create_task(state_lock.lock(tmp_path))
    await clock.advance(HEALTHY_S + LOOK_S)
    assert f"process {os.getpid()}" in await refused(again, "ALREADY_RUNNING")
    with daemon(tmp_path) as other:
        assert f"pid={os.getpid()}" in other.found
    held.release()
    (await locked_at_once(tmp_path, clock)).release()


@pytest.mark.skipif(os.geteuid() != 0, reason="a container needs root")
async def test_daemon_outside_the_container_cannot_be_named(tmp_path: Path) -> None:
    held = await state_lock.lock(tmp_path)
    with daemon(tmp_path, "unshare", "--pid", "--fork", "--kill-child") as inside:
        assert inside.found == repr(Holder(0, "", is_ending=False))
    held.release()


def test_process_that_was_killed_is_seen_to_die(tmp_path: Path) -> None:
    process = subprocess.Popen(["sleep", "infinity"])
    assert not state_lock.is_dying(process.pid)
    process.kill()
    until("it is seen to die", lambda: state_lock.is_dying(process.pid))
    process.wait()
    assert not state_lock.is_dying(process.pid), "a process that is gone does not die"
