"""Children do what may block, and nothing they meet reaches the daemon but an answer."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import resource
import select
import signal
import subprocess
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.processes import process_ended
from tests.kit.until import until_async

from nondum.host.forking.fork_client import REST_S, Forked
from nondum.host.jobs import allowance
from nondum.host.jobs.children import (
    AHEAD_S,
    ASIDE_STALL_S,
    KEPT,
    QUIET_S,
    STALL_S,
    START_S,
    Children,
)
from nondum.host.rpc.outcomes import packed
from nondum.sdk.errors import DriveGone, InstallFailed
from nondum.sdk.pieces import cut
from nondum.sdk.wire import Request, encode
from nondum.transport import link_sockets

pytestmark = pytest.mark.anyio

NOTHING: dict[str, list[str]] = {
    "payloads": [],
    "certificates": [],
    "trust": [],
    "flaws": [],
    "trust_problems": [],
}
"""What is found on an empty drive."""


@contextlib.asynccontextmanager
async def children() -> AsyncIterator[Children]:
    pool = Children()
    try:
        yield pool
    finally:
        await pool.close()


def drive(root: Path) -> dict[str, Any]:
    return {
        "kind": "slot",
        "root": str(root),
        "node": None,
        "filesystem": "",
        "allow_unsigned": True,
    }


async def test_child_works_again_for_the_same_drive_only(tmp_path: Path) -> None:
    async with children() as pool:
        assert await pool.run("look", drive(tmp_path), owner="a") == NOTHING
        first = pool.kept()["a"]
        assert await pool.run("look", drive(tmp_path), owner="a") == NOTHING
        assert pool.kept() == {"a": first}
        await pool.run("look", drive(tmp_path), owner="b")
        assert pool.kept()["b"] != first


def test_child_ends_in_silence_once_its_daemon_was_killed(tmp_path: Path) -> None:
    program = [sys.executable, "-c", "from nondum.host.jobs import child; child.work()"]
    daemon, requests = link_sockets()
    with requests, daemon:
        for packet in cut(encode(Request(1, "look", packed(drive(tmp_path))))):
            daemon.send(packet)
        daemon.close()
        ended = subprocess.run(program, stdin=requests.fileno(), capture_output=True, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, b"", b"")


async def test_child_without_an_owner_ends_with_its_job(tmp_path: Path) -> None:
    async with children() as pool:
        await pool.run("look", drive(tmp_path))
        assert not pool.kept()


async def test_child_is_held_to_what_children_may_use(tmp_path: Path) -> None:
    async with children() as pool:
        await pool.run("look", drive(tmp_path), owner="a")
        limits = (resource.RLIMIT_AS, resource.RLIMIT_CORE)
        held = [resource.prlimit(pool.kept()["a"], limit) for limit in limits]
        assert held == [(allowance.ADDRESS_SPACE, allowance.ADDRESS_SPACE), (0, 0)]


async def test_few_children_are_kept_however_many_drives_there_are(tmp_path: Path) -> None:
    async with children() as pool:
        names = [f"drive-{number}" for number in range(KEPT + 2)]
        for name in names:
            await pool.run("look", drive(tmp_path), owner=name)
        assert list(pool.kept()) == names[2:]


async def test_typed_errors_come_back_typed(tmp_path: Path) -> None:
    async with children() as pool:
        with pytest.raises(DriveGone) as gone:
            await pool.run("look", drive(tmp_path / "nowhere"))
        assert gone.value.code == "DRIVE_GONE"


async def test_fault_of_ours_comes_back_as_a_problem(tmp_path: Path) -> None:
    async with children() as pool:
        with pytest.raises(InstallFailed) as failed:
            await pool.run("look", {})
        assert failed.value.code == "INTERNAL"
        assert await pool.run("look", drive(tmp_path)) == NOTHING


async def test_child_that_dies_is_told(tmp_path: Path) -> None:
    async with children() as pool:
        await pool.run("look", drive(tmp_path), owner="a")
        os.kill(pool.kept()["a"], signal.SIGBUS)
        with pytest.raises(InstallFailed) as failed:
            await pool.run("look", drive(tmp_path), owner="a")
        assert failed.value.code == "CHILD_DIED"
        assert "SIGBUS" in str(failed.value)
        assert await pool.run("look", drive(tmp_path), owner="a") == NOTHING


async def test_child_that_computes_for_ever_is_told(tmp_path: Path) -> None:
    """What the kernel does at the end of the processor time, done here at once."""
    async with children() as pool:
        await pool.run("look", drive(tmp_path), owner="a")
        os.kill(pool.kept()["a"], signal.SIGXCPU)
        with pytest.raises(InstallFailed) as failed:
            await pool.run("look", drive(tmp_path), owner="a")
        assert failed.value.code == "CHILD_LIMIT"


async def test_child_that_hangs_is_given_up(tmp_path: Path, clock: VirtualClock) -> None:
    """A FIFO that no process writes to stands for a disk that never answers."""
    async with children() as pool:
        job = asyncio.create_task(pool.run("verify", staged_fifo(tmp_path)))
        await until_async("a child", pool.pids)
        await clock.advance(STALL_S * 0.9)
        assert not job.done()
        with pytest.raises(InstallFailed) as failed:
            await clock.advance_until(job, step_s=STALL_S * 0.1)
        assert failed.value.code == "CHILD_STALLED"


async def test_cancelled_job_ends_its_child(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "CONTENTS")
    async with children() as pool:
        await pool.run("look", drive(tmp_path), owner="a")
        busy = set(pool.kept().values())
        arguments = {**host_facts(tmp_path), "staging": str(tmp_path)}
        job = asyncio.create_task(pool.run("verify", arguments, owner="a"))
        await asyncio.sleep(0)  # the child has the job from now on
        job.cancel()
        await asyncio.gather(job, return_exceptions=True)
        assert job.cancelled()
        assert not busy & pool.pids()


async def test_work_aside_is_idle_and_ends_with_its_child(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "CONTENTS")
    arguments = {**host_facts(tmp_path), "folder": str(tmp_path), "venvs": str(tmp_path)}
    async with children() as pool:
        job = asyncio.create_task(pool.run_aside("compile", arguments))
        await until_async("a child", pool.pids)
        (pid,) = pool.pids()
        assert os.sched_getscheduler(pid) == os.SCHED_IDLE
        with process_ended(pid) as ended:
            job.cancel()
            await ended.wait()
        await asyncio.wait([job])
        assert not pool.pids()


@pytest.mark.skipif(os.geteuid() != 0, reason="the way back from idle needs root or RLIMIT_NICE")
async def test_work_aside_is_not_idle_when_it_is_to_end(tmp_path: Path) -> None:
    """It would wait for a processor that others have, and be taken for one that hangs in a disk."""
    async with children() as pool:
        job = asyncio.create_task(pool.run_aside("verify", staged_fifo(tmp_path)))
        await until_async("a child", pool.pids)
        (pid,) = pool.pids()
        assert pool.server is not None
        os.kill(pool.server, signal.SIGSTOP)  # what has ended stays to be looked at
        job.cancel()
        await until_async("an ordinary child", lambda: os.sched_getscheduler(pid) == os.SCHED_OTHER)
        os.kill(pool.server, signal.SIGCONT)
        await asyncio.wait([job])


async def test_slow_start_is_not_the_drive_s(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, clock: VirtualClock
) -> None:
    """Whatever is wrong with a drive, it is not that this computer is small and has much to do."""
    slow, gate = tmp_path / "python", tmp_path / "gate"
    os.mkfifo(gate)
    first = f"import os, sys; open({str(gate)!r}).close()"
    then = f"os.execv({sys.executable!r}, [{sys.executable!r}, *sys.argv[1:]])"
    slow.write_text(f"#!{sys.executable} -ISB\n{first}; {then}\n")
    slow.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(slow))
    async with children() as pool:
        job = asyncio.create_task(pool.run("look", drive(tmp_path), stall_s=1.5))
        await until_async("its server", lambda: pool.server)
        await clock.advance(START_S * 0.9)
        await asyncio.to_thread(gate.write_text, "")  # it opens the other end, and goes on
        assert await job == NOTHING


async def test_work_aside_gives_its_answer(tmp_path: Path, clock: VirtualClock) -> None:
    async with children() as pool:
        assert await pool.run_aside("look", drive(tmp_path)) == NOTHING
        assert not pool.pids()
        with pytest.raises(DriveGone):
            await pool.run_aside("look", drive(tmp_path / "nowhere"))
        hanging = pool.run_aside("verify", staged_fifo(tmp_path))
        with pytest.raises(InstallFailed) as failed:
            await clock.advance_until(hanging, step_s=ASIDE_STALL_S * 0.1)
        assert failed.value.code == "CHILD_STALLED"
        assert not pool.pids()


async def test_no_child_is_kept_when_work_has_ended(tmp_path: Path, clock: VirtualClock) -> None:
    async with children() as pool:
        await pool.run("look", drive(tmp_path), owner="a")
        await clock.advance(QUIET_S * 0.9)
        with process_ended(pool.kept()["a"]) as ended:
            await clock.advance(QUIET_S * 0.1)
            await ended.wait()
        assert not pool.kept()


async def ahead(pool: Children, clock: VirtualClock) -> int:
    """The child that is forked once a first one has ended with its job."""
    await pool.run("look", drive(Path("/")))
    await clock.advance(AHEAD_S)
    await until_async("a child ahead", lambda: bool(pool.pids()))
    (pid,) = pool.pids()
    return pid


async def test_next_child_is_forked_before_it_is_needed(
    tmp_path: Path, clock: VirtualClock
) -> None:
    async with children() as pool:
        waiting = await ahead(pool, clock)
        assert await pool.run("look", drive(tmp_path), owner="a") == NOTHING
        assert pool.kept() == {"a": waiting}
        assert await pool.run("look", drive(tmp_path), owner="b") == NOTHING
        assert pool.kept()["b"] != waiting, "it has read what another one brought"


async def test_child_that_died_waiting_is_replaced(tmp_path: Path, clock: VirtualClock) -> None:
    async with children() as pool:
        waiting = await ahead(pool, clock)
        with process_ended(waiting) as ended:
            os.kill(waiting, signal.SIGKILL)
            await ended.wait()
        assert await pool.run("look", drive(tmp_path), owner="a") == NOTHING


async def test_none_is_forked_ahead_while_another_works(
    tmp_path: Path, clock: VirtualClock
) -> None:
    """A server that does not answer in time is killed, and with it all that it has forked."""
    async with children() as pool:
        await pool.run("look", drive(tmp_path))
        works = pool.run("verify", staged_fifo(tmp_path), stall_s=100 * START_S)
        working = asyncio.create_task(works)
        await until_async("a child", lambda: len(pool.pids()) == 1)
        assert pool.server is not None
        os.kill(pool.server, signal.SIGSTOP)
        try:
            await clock.advance(AHEAD_S + 2 * START_S)
        finally:
            os.kill(pool.server, signal.SIGCONT)
        assert not working.done()
        working.cancel()
        await asyncio.wait([working])


async def test_none_is_forked_ahead_while_another_is_being_forked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, clock: VirtualClock
) -> None:
    async with children() as pool:
        await pool.run("look", drive(tmp_path))
        assert pool.server is not None
        asked, fork = [], pool.forks.fork

        async def noted(message: str, patience_s: float) -> Forked:
            asked.append(message)
            return await fork(message, patience_s)

        monkeypatch.setattr(pool.forks, "fork", noted)
        os.kill(pool.server, signal.SIGSTOP)
        try:
            coming = asyncio.create_task(pool.run("look", drive(tmp_path)))
            await clock.advance(2 * AHEAD_S)
        finally:
            os.kill(pool.server, signal.SIGCONT)
        assert await coming == NOTHING
        assert asked == ["look"]


@pytest.mark.parametrize("aside", [False, True])
async def test_fork_server_that_does_not_stay_ends_after_the_last_child(
    tmp_path: Path, clock: VirtualClock, aside: bool
) -> None:
    pool = Children(stays=lambda: False)
    try:
        if aside:
            await pool.run_aside("look", drive(tmp_path))
        else:
            await pool.run("look", drive(tmp_path), owner="a")
        assert pool.server is not None
        with process_ended(pool.server) as ended:
            await clock.advance(QUIET_S)
            await clock.advance_until(ended.wait(), REST_S)
        await pool.run("look", drive(tmp_path), owner="a")
    finally:
        await pool.close()


async def test_child_is_not_said_to_hang_before_the_server_tells_its_end(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with children() as pool:
        await pool.run("look", drive(tmp_path), owner="a")
        assert pool.server is not None
        os.kill(pool.server, signal.SIGSTOP)
        try:
            with caplog.at_level(logging.WARNING):
                await pool.release("a")
        finally:
            os.kill(pool.server, signal.SIGCONT)
    assert caplog.records == []


async def test_no_child_outlives_the_pool(tmp_path: Path) -> None:
    async with children() as pool:
        await pool.run("look", drive(tmp_path), owner="a")
        child = os.pidfd_open(pool.kept()["a"])
    try:
        assert select.select([child], [], [], 0)[0], "a pidfd can be read once its process is over"
    finally:
        os.close(child)


async def test_listing_of_an_empty_store_is_empty(tmp_path: Path) -> None:
    async with children() as pool:
        assert await pool.run("listing", {**host_facts(tmp_path), "folders": []}) == []


def staged_fifo(root: Path) -> dict[str, Any]:
    staging = root / "staging"
    staging.mkdir()
    os.mkfifo(staging / "CONTENTS")
    return {**host_facts(root), "staging": str(staging)}


def host_facts(root: Path) -> dict[str, Any]:
    return {"store": str(root / "store"), "reserve_mb": 0, "confinement": "none", "method": "store"}


def test_what_people_wait_for_is_done_without_what_only_daemons_need() -> None:
    """Each child shares what its fork server has imported: time at each start, and memory."""
    needless = ("lark", "nondum.planning", "nondum.host.core.events", "nondum.host.core.records")
    program = f"""
import sys
from nondum.host.jobs import child, table
for job in table.AT_ONCE:
    table.find(job)
print([name for name in {needless} if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert done.stdout == b"[]\n"
