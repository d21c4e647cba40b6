"""A daemon as its service manager hears it: ready once it serves, alive as long as it gets on."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import sqlite3
import subprocess
from collections.abc import AsyncIterator, Coroutine, Iterator
from contextlib import asynccontextmanager, closing, contextmanager, suppress
from pathlib import Path

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.command_line import clean_environment
from tests.kit.running_host import DAEMON, RunningHost, running, until_ended
from tests.kit.until import until

from nondum.host.core.bus import Bus
from nondum.host.core.events.daemon import HostStarted
from nondum.host.lifecycle.advance import RULES
from nondum.host.manager import state_lock
from nondum.host.manager.state_lock import Holder
from nondum.host.service.notify import Notifier
from nondum.host.service.service import BETWEEN_WORDS_S, LONGEST_START_S, STARTING_S, Part, Service

PATIENCE_S = 60.0


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(str(tmp_path / "notify"))
        sock.settimeout(PATIENCE_S)
        yield sock


def received(manager: socket.socket, *wanted: str) -> list[str]:
    """All that is said until the wanted assignments have been, in their order."""
    said: list[str] = []
    for one in wanted:
        while not any(line.startswith(one) for line in said[-1:]):
            said += manager.recv(65_536).decode().splitlines()[:1]
    return said


@contextmanager
def served(
    host: RunningHost, manager: socket.socket, watchdog_s: float = 60.0
) -> Iterator[subprocess.Popen[str]]:
    """A real daemon of a host, as systemd would start it."""
    asked = {
        "NOTIFY_SOCKET": manager.getsockname(),
        "WATCHDOG_USEC": str(round(watchdog_s * 1e6)),
    }
    process = subprocess.Popen(
        [*DAEMON, "--config", str(host.config)],
        stderr=subprocess.PIPE,
        text=True,
        env=clean_environment() | asked,
    )
    with process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGCONT)
            process.terminate()


def test_daemon_is_ready_once_it_answers_and_says_what_it_does(
    tmp_path: Path, manager: socket.socket
) -> None:
    host = RunningHost(tmp_path)
    with served(host, manager) as daemon:
        said = received(manager, "EXTEND_TIMEOUT_USEC=", "READY=1")
        assert host.run("status").ok().out.startswith("host ")
        assert "STATUS=starting" in said
        received(manager, "STATUS=0 components at work")
        daemon.terminate()
        received(manager, "STOPPING=1")


def test_daemon_that_is_started_while_the_one_before_it_ends_comes_up_after_it(
    tmp_path: Path, manager: socket.socket
) -> None:
    """The first one is stopped while it ends, until the other one waits for it."""
    with running(tmp_path) as host:
        before = host.pid
        with locked_catalogue(host):  # for its last words
            os.kill(before, signal.SIGTERM)
            until("it shows that it is ending", lambda: holder(host).is_ending)
            os.kill(before, signal.SIGSTOP)
        with served(host, manager):
            received(manager, f"STATUS=waiting for process {before} ")
            os.kill(before, signal.SIGCONT)
            until_ended(before)
            assert host.stop() == 0
            received(manager, "READY=1")


def holder(host: RunningHost) -> Holder:
    found = state_lock.attempt(host.state)
    assert isinstance(found, Holder), "nothing has the lock"
    return found


@contextmanager
def locked_catalogue(host: RunningHost) -> Iterator[None]:
    """Nothing can be written to it."""
    with closing(sqlite3.connect(host.state / "catalogue.sqlite")) as connection:
        connection.execute("BEGIN IMMEDIATE")
        yield


def test_daemon_gives_signs_of_life_whenever_it_runs(
    tmp_path: Path, manager: socket.socket
) -> None:
    with served(RunningHost(tmp_path), manager, watchdog_s=0.4) as daemon:
        received(manager, "READY=1", "WATCHDOG=1")
        received(manager, "WATCHDOG=1")
        daemon.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, daemon.pid, os.WSTOPPED)
        said(manager)
        daemon.send_signal(signal.SIGCONT)
        manager.settimeout(PATIENCE_S)
        received(manager, "WATCHDOG=1")


def said(manager: socket.socket) -> list[str]:
    """All that is said and was not heard yet, without waiting."""
    manager.setblocking(False)
    lines: list[str] = []
    with suppress(BlockingIOError):
        while True:
            lines += manager.recv(65_536).decode().splitlines()
    return lines


@asynccontextmanager
async def during(work: Coroutine[None, None, None]) -> AsyncIterator[None]:
    """Something that goes on until the end of the block."""
    task = asyncio.create_task(work)
    try:
        yield
    finally:
        task.cancel()
        await asyncio.wait({task})


WATCHDOG_S = 40.0
SIGN = "WATCHDOG=1"


@pytest.mark.anyio
async def test_signs_of_life_are_four_in_the_time_allowed_for_one(
    manager: socket.socket, clock: VirtualClock
) -> None:
    async with Service(Notifier(manager.getsockname(), WATCHDOG_S)) as service:
        part = Part("the mind", lambda: 0, lambda: 0)
        service.on_event(HostStarted("spot"))
        async with during(service.watched([part])):
            await clock.settle()
            assert said(manager)[-1] == SIGN
            await clock.advance(WATCHDOG_S)
            assert said(manager).count(SIGN) == 4


@pytest.mark.anyio
async def test_part_that_hangs_ends_the_signs_of_life(
    manager: socket.socket, clock: VirtualClock
) -> None:
    """And one that comes back begins them again."""
    bus, passed = Bus(RULES), asyncio.Event()

    async def follow() -> None:
        while True:
            await bus.batch()
            await passed.wait()

    async with Service(Notifier(manager.getsockname(), WATCHDOG_S)) as service:
        part = Part("the manager", lambda: bus.taken, lambda: bus.followed)
        service.on_event(HostStarted("spot"))
        async with during(service.watched([part])), during(follow()):
            await clock.settle()
            assert said(manager)[-1] == SIGN
            bus.emit(HostStarted("spot"))
            await clock.advance(WATCHDOG_S / 4)
            assert said(manager) == [SIGN], "what came since the last sign is owed by the next"
            await clock.advance(10 * WATCHDOG_S)
            assert said(manager) == []
            passed.set()
            await clock.advance(WATCHDOG_S / 4)
            assert said(manager) == [SIGN]


@pytest.mark.anyio
async def test_mind_that_does_not_tick_ends_the_signs_of_life(
    manager: socket.socket, clock: VirtualClock
) -> None:
    ticks = 0
    async with Service(Notifier(manager.getsockname(), WATCHDOG_S)) as service:
        part = Part("the mind", lambda: ticks + 1, lambda: ticks)
        service.on_event(HostStarted("spot"))
        async with during(service.watched([part])):
            await clock.settle()
            assert said(manager)[-1] == SIGN
            await clock.advance(10 * WATCHDOG_S)
            assert said(manager) == []
            ticks += 1
            await clock.advance(WATCHDOG_S / 4)
            assert said(manager) == [SIGN]


@pytest.mark.anyio
async def test_start_asks_for_more_time_until_the_longest_is_over(
    manager: socket.socket, clock: VirtualClock
) -> None:
    async with Service(Notifier(manager.getsockname())):
        await clock.settle()
        for _ in range(round(LONGEST_START_S / STARTING_S)):
            assert said(manager)[-1] == f"EXTEND_TIMEOUT_USEC={3 * STARTING_S * 1e6:.0f}"
            await clock.advance(STARTING_S)
        assert said(manager) == []


@pytest.mark.anyio
async def test_status_is_told_only_when_it_is_another(
    manager: socket.socket, clock: VirtualClock
) -> None:
    """And no more often than people can read it."""
    versions = asyncio.Queue[int]()
    words = iter(["one", "one", "two"])

    async def changed(_: int | None) -> int:
        return await versions.get()

    async with Service(Notifier(manager.getsockname())) as service:
        service.on_event(HostStarted("spot"))
        await clock.settle()
        assert said(manager)[-1] == "READY=1"
        async with during(service.told(lambda: next(words), changed)):
            for version in range(3):
                versions.put_nowait(version)
            await clock.settle()
            assert said(manager) == ["STATUS=one"]
            await clock.advance(BETWEEN_WORDS_S)
            assert said(manager) == []
            await clock.advance(BETWEEN_WORDS_S)
            assert said(manager) == ["STATUS=two"]
