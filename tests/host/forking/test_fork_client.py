"""The daemon outlives its fork server, whatever happens to it, and is told what did."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import os
import signal
import socket
import sys
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.descriptors import descriptors_left, open_descriptors
from tests.kit.processes import process_ended
from tests.kit.until import arrived, until_async
from tests.kit.watches import watches_left

from nondum.host.forking import fork_server
from nondum.host.forking.fork_client import REST_S, ForkClient
from nondum.host.jobs.children import START_S, Children
from nondum.sdk.errors import InstallFailed

pytestmark = pytest.mark.anyio

ROOT = Path(__file__).parents[3]
JOB = "listing"
WithPython = Callable[[str], None]


@contextlib.asynccontextmanager
async def fork_client(
    module: str = "nondum.host.jobs.child",
    on_crowded: Callable[[], None] = lambda: None,
    *,
    stays: Callable[[], bool] | None = None,
) -> AsyncIterator[ForkClient]:
    client = ForkClient(module, on_crowded, stays=stays)
    try:
        yield client
    finally:
        await client.close()


@contextlib.asynccontextmanager
async def children() -> AsyncIterator[Children]:
    pool = Children()
    try:
        yield pool
    finally:
        await pool.close()


@pytest.fixture
def with_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> WithPython:
    """Have the server be started by this shell script instead of Python."""

    def replace(script: str) -> None:
        program = tmp_path / "python"
        program.write_text(f"#!/bin/sh\n{script}\n")
        program.chmod(0o755)
        monkeypatch.setattr(sys, "executable", str(program))

    return replace


def server_of(client: ForkClient) -> int:
    assert client.pid is not None
    return client.pid


async def test_killed_server_takes_its_processes_along() -> None:
    async with fork_client() as client:
        forked = await client.fork(JOB, START_S)
        with process_ended(forked.pid) as ended:
            os.kill(server_of(client), signal.SIGKILL)
            await ended.wait()
        assert await forked.wait() == -signal.SIGKILL
        assert forked.conversation.recv(1) == b""
        forked.close()


async def test_killed_server_is_started_again_with_a_warning(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with fork_client() as client:
        first = await client.fork(JOB, START_S)
        former = server_of(client)
        os.kill(former, signal.SIGKILL)
        await first.wait()
        with caplog.at_level(logging.WARNING):
            second = await client.fork(JOB, START_S)
        assert server_of(client) != former
        assert [record.name for record in caplog.records] == ["nondum.host.forking.fork_client"]
        os.kill(second.pid, 0)
        first.close()
        second.close()


async def test_return_code_is_that_of_the_process() -> None:
    async with fork_client() as client:
        killed, ends = await client.fork(JOB, START_S), await client.fork(JOB, START_S)
        ends.conversation.send(b"no piece")
        killed.kill()
        assert await killed.wait() == killed.returncode == -signal.SIGKILL
        running = await client.fork(JOB, START_S)
        assert running.returncode is None
        for forked in (killed, ends, running):
            forked.close()


async def test_end_of_a_process_is_seen_while_the_server_has_no_time_to_tell_it() -> None:
    async with fork_client() as client:
        child = await client.fork(JOB, START_S)
        os.kill(server_of(client), signal.SIGSTOP)
        try:
            child.kill()
            await child.over()
            assert child.is_over and child.returncode is None, "the server has told nothing"
        finally:
            os.kill(server_of(client), signal.SIGCONT)
        assert await child.wait() == -signal.SIGKILL
        child.close()


async def test_server_that_has_ended_prepares_for_nothing_and_is_started_again() -> None:
    async with fork_client() as client:
        await client.expect(JOB)
        former = server_of(client)
        with process_ended(former) as ended:
            os.kill(former, signal.SIGKILL)
            await ended.wait()
        await client.expect("sweep")
        forked = await client.fork(JOB, START_S)
        assert server_of(client) != former
        forked.close()


async def test_server_that_does_not_stay_is_there_while_something_of_it_runs(
    clock: VirtualClock,
) -> None:
    async with fork_client(stays=lambda: False) as client:
        forked = await client.fork(JOB, START_S)
        first = server_of(client)
        await clock.advance(10 * REST_S)
        assert client.pid == first
        forked.kill()
        await forked.over()
        with process_ended(first) as ended:
            await clock.advance(REST_S)
            await ended.wait()  # which takes real time: none of END_S passes meanwhile
        forked.close()
        (await client.fork(JOB, START_S)).close()
        assert server_of(client) != first


async def test_server_stays_as_long_as_it_is_said_to(clock: VirtualClock) -> None:
    stays = [True]
    async with fork_client(stays=lambda: stays[0]) as client:
        await client.expect(JOB)
        first = server_of(client)
        await clock.advance(10 * REST_S)
        assert client.pid == first
        stays[0] = False
        with process_ended(first) as ended:
            await clock.advance(REST_S)
            await ended.wait()  # which takes real time: none of END_S passes meanwhile


async def test_server_that_was_just_used_does_not_end(clock: VirtualClock) -> None:
    async with fork_client(stays=lambda: False) as client:
        first = 0
        for _ in range(5):
            forked = await client.fork(JOB, START_S)
            forked.kill()
            await forked.over()
            forked.close()
            assert first in (0, server_of(client))
            first = server_of(client)
            await clock.advance(0.8 * REST_S)


async def test_process_is_killed_once_nothing_waits_for_it() -> None:
    async with fork_client() as client:
        (await client.fork(JOB, START_S)).close()
        forking = asyncio.create_task(client.fork(JOB, START_S))
        await asyncio.sleep(0)  # its request is under way from now on
        forking.cancel()
        await asyncio.wait([forking])
        assert forking.cancelled()
        wanted = await client.fork(JOB, START_S)
        await until_async("one process", lambda: forked_by(server_of(client)) == [wanted.pid])
        wanted.close()


async def test_server_and_its_processes_end_with_the_client() -> None:
    async with fork_client() as client:
        forked = await client.fork(JOB, START_S)
        server = server_of(client)
        with process_ended(forked.pid) as forked_ended, process_ended(server) as server_ended:
            await client.close()
            await asyncio.gather(forked_ended.wait(), server_ended.wait())
        assert client.pid is None
        forked.close()


async def test_server_that_cannot_fork_says_why_and_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    async with fork_client("tests.host.forking.server_that_cannot_fork") as client:
        with pytest.raises(OSError) as first:
            await client.fork(JOB, START_S)
        assert first.value.errno == errno.EAGAIN
        server = server_of(client)
        with pytest.raises(OSError) as second:
            await client.fork(JOB, START_S)
        assert second.value.errno == errno.EAGAIN
        assert server_of(client) == server


async def test_server_that_may_not_send_yet_is_asked_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    refusals: list[None] = []
    module = "tests.host.forking.server_that_may_not_send"
    async with fork_client(module, lambda: refusals.append(None)) as client:
        forked = await client.fork(JOB, START_S)
        assert len(refusals) == 1
        await until_async("it only", lambda: forked_by(server_of(client)) == [forked.pid])
        forked.kill()
        assert await forked.wait() == -signal.SIGKILL
        forked.close()


@pytest.mark.parametrize("left", range(4))
async def test_process_for_which_descriptors_are_missing_leaves_none_open(left: int) -> None:
    """It takes two for the conversation, and two for the return code."""
    async with fork_client() as client:
        await client.expect(JOB)
        before = open_descriptors()
        with descriptors_left(left), pytest.raises(OSError) as failed:
            await client.fork(JOB, START_S)
        assert failed.value.errno == errno.EMFILE
        await asyncio.sleep(0)  # what a transport closes, it closes on the loop's next turn
        assert open_descriptors() == before


@pytest.mark.parametrize(
    "watched",
    [
        pytest.param(0, id="the answer"),
        pytest.param(1, id="its end"),
        pytest.param(2, id="its return code"),
    ],
)
async def test_process_that_cannot_be_watched_is_none(watched: int) -> None:
    """Nothing is left of it, and the next one's answer is that one's own."""
    async with fork_client() as client:
        other = await client.fork(JOB, START_S)
        server, before = server_of(client), open_descriptors()
        with watches_left(watched), pytest.raises(OSError) as failed:
            await client.fork(JOB, START_S)
        assert failed.value.errno == errno.ENOSPC
        await asyncio.sleep(0)  # what a transport closes, it closes on the loop's next turn
        assert open_descriptors() == before
        wanted = await client.fork(JOB, START_S)
        both = [other.pid, wanted.pid]
        await until_async("both", lambda: forked_by(server_of(client)) == both)
        wanted.kill()
        assert await arrived("its own end", wanted.wait()) == -signal.SIGKILL
        assert server_of(client) == server
        other.close()
        wanted.close()


async def test_process_costs_no_other_one_where_no_descriptor_is_left_for_its_pidfd() -> None:
    async with fork_client() as client:
        other = await client.fork(JOB, START_S)
        server, before = server_of(client), open_descriptors()
        os.kill(server, signal.SIGSTOP)
        forking = asyncio.create_task(client.fork(JOB, START_S))
        for _ in range(10):  # turns of the loop, after which it waits for the answer
            await asyncio.sleep(0)
        with descriptors_left(0), pytest.raises(OSError) as failed:
            os.kill(server, signal.SIGCONT)
            await forking
        assert failed.value.errno == errno.EMFILE
        await asyncio.sleep(0)
        assert open_descriptors() == before
        await until_async("the other one", lambda: forked_by(server) == [other.pid])
        assert server_of(client) == server
        other.close()


def test_answer_says_so_where_no_descriptor_is_left_for_its_pidfd() -> None:
    channel, of_server = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with channel, of_server:
        socket.send_fds(of_server, [b"7"], [of_server.fileno()])
        with descriptors_left(0), pytest.raises(OSError) as failed:
            fork_server.answer(channel)
    assert failed.value.errno == errno.EMFILE


async def test_server_that_ends_as_it_starts_is_told(with_python: WithPython) -> None:
    with_python("exit 1")
    async with children() as pool:
        with pytest.raises(InstallFailed) as failed:
            await pool.run(JOB, {})
        assert failed.value.code == "CHILD_DIED"
        assert pool.server is None


async def test_server_that_is_not_there_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "nowhere"))
    async with children() as pool:
        with pytest.raises(InstallFailed) as failed:
            await pool.run(JOB, {})
        assert failed.value.code == "IO_ERROR"
        assert pool.server is None


async def test_server_that_says_nothing_is_given_up(
    with_python: WithPython, clock: VirtualClock
) -> None:
    with_python("exec sleep infinity")
    async with children() as pool:
        job = asyncio.create_task(pool.run(JOB, {}))
        await until_async("its server", lambda: pool.server)
        silent = pool.server
        assert silent is not None
        with process_ended(silent) as ended:
            await clock.advance(START_S)
            with pytest.raises(InstallFailed) as failed:
                await job
            await ended.wait()
        assert failed.value.code == "CHILD_STALLED"
        assert pool.server is None


def forked_by(pid: int) -> list[int]:
    return [int(each) for each in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
