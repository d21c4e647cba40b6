"""A sandbox ends with its daemon, however far it is set up: no process waits in it for ever."""

from __future__ import annotations

import asyncio
import os
import shutil
import signal
import sys
from pathlib import Path

import pytest
from tests.kit.descendants import pids
from tests.kit.processes import is_alive
from tests.kit.until import until_async
from tests.sandbox.processes import children

pytestmark = pytest.mark.anyio

BWRAP = shutil.which("bwrap") or "bwrap"
STARTUP_S = 60.0
DAEMON = f"""
import signal, sys
from nondum.host.workers.boxed import Boxed
from nondum.host.workers.spare import Spare

bwrap, has_users, is_settled = sys.argv[1], *(word == "yes" for word in sys.argv[2:])
boxed = Boxed(bwrap, has_users=has_users)
spare = Spare(boxed, boxed.ground(None))
print(spare.popen.pid, flush=True)
if is_settled:
    spare.settle({STARTUP_S})
signal.pause()
"""
STOPS_FIRST = f'#!/bin/sh\nkill -STOP $$\nexec {BWRAP} "$@"\n'

each_kind = pytest.mark.parametrize(
    "users",
    [
        pytest.param(
            "yes",
            marks=pytest.mark.skipif(os.geteuid() != 0, reason="only root can give users"),
            id="a user each",
        ),
        pytest.param("no", id="the host's user"),
    ],
)


class Daemon:
    """A daemon that has started an interpreter in a sandbox; only its death is of interest."""

    def __init__(self, process: asyncio.subprocess.Process, outer: int) -> None:
        self._process, self.outer = process, outer

    @classmethod
    async def with_spare(cls, users: str, *, bwrap: str = BWRAP, is_settled: str = "no") -> Daemon:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-c", DAEMON, bwrap, users, is_settled),
            stdout=asyncio.subprocess.PIPE,
        )
        assert process.stdout is not None
        return cls(process, int(await process.stdout.readline()))

    async def dies(self) -> None:
        self._process.kill()
        await self._process.communicate()


@each_kind
async def test_sandbox_that_is_not_begun_ends_with_its_daemon(tmp_path: Path, users: str) -> None:
    bwrap = tmp_path / "bwrap"
    bwrap.write_text(STOPS_FIRST)
    bwrap.chmod(0o755)
    daemon = await Daemon.with_spare(users, bwrap=str(bwrap))
    await until_async("a start", lambda: is_stopped(daemon.outer))
    await daemon.dies()
    os.kill(daemon.outer, signal.SIGCONT)
    await until_async("its end", lambda: has_ended(daemon.outer))


@each_kind
async def test_sandbox_that_is_half_made_ends_with_its_daemon(users: str) -> None:
    daemon = await Daemon.with_spare(users)
    await until_async("a namespace", lambda: children(daemon.outer))
    os.kill(daemon.outer, signal.SIGSTOP)
    await daemon.dies()
    os.kill(daemon.outer, signal.SIGCONT)
    await until_async("its end", lambda: has_ended(daemon.outer))


@each_kind
async def test_sandbox_that_waits_for_its_worker_ends_with_its_daemon(users: str) -> None:
    daemon = await Daemon.with_spare(users, is_settled="yes")
    await until_async("a sandbox", lambda: any(map(is_python, children(daemon.outer))))
    await daemon.dies()
    await until_async("its end", lambda: has_ended(daemon.outer))


def has_ended(group: int) -> bool:
    """Whether no process of a group is left, but for the dead ones."""
    return not any(is_alive(pid) for pid in pids() if group_of(pid) == group)


def group_of(pid: int) -> int | None:
    try:
        return os.getpgid(pid)
    except ProcessLookupError:
        return None


def is_stopped(pid: int) -> bool:
    status = Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
    return status.rpartition(")")[2].split()[0] == "T"


def is_python(pid: int) -> bool:
    return Path(f"/proc/{pid}/comm").read_text(encoding="utf-8").startswith("python")
