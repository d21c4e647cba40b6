"""The daemon is killed: its workers leave everything safe, and then end, whatever they do."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from pathlib import Path

import pytest
from tests.kit.processes import is_alive, until_gone
from tests.kit.until import arrived, until_async
from tests.kit.workers import WorkersUnderTest

from nondum.host.workers.launcher import owner_mark
from nondum.host.workers.leftovers import end_leftovers

pytestmark = pytest.mark.anyio

ROOT = Path(__file__).parents[3]
LEVELS = ("sandboxed", "restricted")
DAEMON = """
import asyncio, sys
from pathlib import Path
from tests.kit.workers import WorkersUnderTest

async def main():
    tested = WorkersUnderTest(Path(sys.argv[1]))
    await tested.start("guest", Path(sys.argv[2]).read_text())
    print(tested.workers.pids()["guest"], flush=True)
    await asyncio.Event().wait()

asyncio.run(main())
"""
POLITE = """
import asyncio
from nondum.sdk import hookimpl
@hookimpl
async def stop(ctx):
    await asyncio.sleep(0.5)  # an arm takes its time
    (ctx.scratch / "safe").touch()
"""
STUCK = """
import ctypes, sys, threading
from nondum.sdk import hookimpl

def hold(told):
    sys.setswitchinterval(3600)  # the thread that has the interpreter's lock keeps it
    told.touch()
    ctypes.PyDLL(None).sleep(3600)

@hookimpl
async def start(ctx):
    threading.Timer(0.3, hold, [ctx.scratch / "held"]).start()
"""


async def daemon_with(
    folder: Path, plugin: str, level: str
) -> tuple[asyncio.subprocess.Process, int]:
    """A daemon in a separate process, and the id of its worker."""
    source = folder / "source.py"
    source.write_text(plugin)
    paths = [ROOT, *(ROOT / part for part in ("host", "planning", "transport", "wheelhouse"))]
    daemon = await asyncio.create_subprocess_exec(
        *(sys.executable, "-c", DAEMON, str(folder), str(source)),
        stdout=asyncio.subprocess.PIPE,
        env={
            **os.environ,
            "PYTHONPATH": ":".join(map(str, [*paths, ROOT / "plugins/sdk"])),
            "NONDUM_TEST_LEVEL": level,
        },
    )
    assert daemon.stdout is not None
    return daemon, int(await arrived("the worker's process", daemon.stdout.readline()))


async def kill(daemon: asyncio.subprocess.Process) -> None:
    daemon.send_signal(signal.SIGKILL)
    await daemon.communicate()


@pytest.mark.parametrize("level", LEVELS)
async def test_worker_leaves_things_safe_and_ends(tmp_path: Path, level: str) -> None:
    daemon, worker = await daemon_with(tmp_path, POLITE, level)
    await kill(daemon)
    await until_gone(worker)
    assert (tmp_path / "guest/scratch/safe").exists()


@pytest.mark.parametrize("level", LEVELS)
async def test_stuck_interpreter_ends_too(tmp_path: Path, level: str) -> None:
    daemon, worker = await daemon_with(tmp_path, STUCK, level)
    await until_async("held", (tmp_path / "guest/scratch/held").exists)
    await kill(daemon)
    assert is_alive(worker)
    await until_gone(worker)


async def test_next_daemon_ends_what_was_to_become_a_worker(tested: WorkersUnderTest) -> None:
    commands = (
        {"NONDUM_SPARE_OF": f"{tested.folder}:1"},
        {"NONDUM_SPARE_OF": owner_mark(tested.folder)},
    )
    orphan, own = [
        await asyncio.create_subprocess_exec("sleep", "3600", env=marked) for marked in commands
    ]
    assert await asyncio.to_thread(end_leftovers, tested.folder) == 1
    assert await orphan.wait() == -signal.SIGKILL
    assert own.returncode is None
    own.kill()
    await own.wait()


async def test_next_daemon_ends_what_was_left(tested: WorkersUnderTest) -> None:
    orphan = await asyncio.create_subprocess_exec(
        *("sleep", "3600"), env={"NONDUM_WORKER": str(tested.folder / "guest/scratch")}
    )
    stranger = await asyncio.create_subprocess_exec(
        *("sleep", "3600"), env={"NONDUM_WORKER": f"{tested.folder}-other/guest/scratch"}
    )
    assert await asyncio.to_thread(end_leftovers, tested.folder) == 1
    assert await orphan.wait() == -signal.SIGKILL
    assert stranger.returncode is None
    stranger.kill()
    await stranger.wait()
