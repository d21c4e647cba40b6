"""A daemon as its service manager hears it: ready once it serves, alive as long as it gets on."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from tests.host.cli.daemon import Daemon, command, quiet_environment, write_config

from nondum.host.events import HostStarted
from nondum.host.lifecycle.bus import Bus
from nondum.host.service.notify import Notifier
from nondum.host.service.service import Part, Service

PATIENCE_S = 100.0


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(str(tmp_path / "notify"))
        sock.settimeout(PATIENCE_S)
        yield sock


def heard(manager: socket.socket, *wanted: str) -> list[str]:
    """All that is said until the wanted assignments have been, in their order."""
    said: list[str] = []
    for one in wanted:
        while not any(line.startswith(one) for line in said[-1:]):
            said += manager.recv(65_536).decode().splitlines()[:1]
    return said


@contextmanager
def served(root: Path, manager: socket.socket, watchdog_s: float = 60.0) -> Iterator[Daemon]:
    """A real daemon, as systemd would start it."""
    asked = {
        "NOTIFY_SOCKET": manager.getsockname(),
        "WATCHDOG_USEC": str(round(watchdog_s * 1e6)),
    }
    process = subprocess.Popen(
        command("host", "run", "--user", "--config", write_config(root)),
        stderr=subprocess.PIPE,
        text=True,
        env=quiet_environment() | asked,
    )
    with process:
        try:
            yield Daemon(root, process)
        finally:
            process.send_signal(signal.SIGCONT)
            process.terminate()


def test_daemon_is_ready_once_it_answers_and_says_what_it_does(
    tmp_path: Path, manager: socket.socket
) -> None:
    with served(tmp_path, manager) as daemon:
        said = heard(manager, "EXTEND_TIMEOUT_USEC=", "READY=1")
        assert daemon.run("status").ok().out.startswith("host ")
        assert "STATUS=starting" in said
        heard(manager, "STATUS=0 components at work")
        daemon.process.terminate()
        heard(manager, "STOPPING=1")


def test_daemon_gives_signs_of_life_until_it_is_stopped(
    tmp_path: Path, manager: socket.socket
) -> None:
    """Four within the time that is allowed for one; and none, while it does not run."""
    with served(tmp_path, manager, watchdog_s=0.4) as daemon:
        heard(manager, "READY=1", "WATCHDOG=1")
        heard(manager, "WATCHDOG=1")
        daemon.process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, daemon.process.pid, os.WSTOPPED)
        manager.setblocking(False)
        with pytest.raises(BlockingIOError):
            while True:
                manager.recv(65_536)
        manager.settimeout(1.0)
        with pytest.raises(TimeoutError):
            manager.recv(65_536)
        daemon.process.send_signal(signal.SIGCONT)
        manager.settimeout(PATIENCE_S)
        heard(manager, "WATCHDOG=1")


@pytest.mark.anyio
async def test_part_that_hangs_ends_the_signs_of_life(manager: socket.socket) -> None:
    """And one that comes back begins them anew."""
    manager.setblocking(False)
    loop = asyncio.get_running_loop()
    bus, passed = Bus(), asyncio.Event()

    async def next_sign() -> bytes:
        return await loop.sock_recv(manager, 4096)

    async def follow() -> None:
        while True:
            await bus.batch()
            await passed.wait()

    async with Service(Notifier(manager.getsockname(), watchdog_s=0.04)) as service:
        part = Part("the manager", lambda: bus.taken, lambda: bus.followed)
        tasks = [asyncio.create_task(service.watched([part])), asyncio.create_task(follow())]
        while await next_sign() != b"WATCHDOG=1\n":
            pass
        bus.emit(HostStarted("spot"))
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.0):
                while True:
                    await next_sign()
        passed.set()
        async with asyncio.timeout(PATIENCE_S):
            assert await next_sign() == b"WATCHDOG=1\n"
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


@pytest.mark.anyio
async def test_mind_that_does_not_tick_ends_the_signs_of_life(manager: socket.socket) -> None:
    manager.setblocking(False)
    loop, ticks = asyncio.get_running_loop(), 0
    async with Service(Notifier(manager.getsockname(), watchdog_s=0.04)) as service:
        part = Part("the mind", lambda: ticks + 1, lambda: ticks)
        task = asyncio.create_task(service.watched([part]))
        for _ in range(3):  # starting, its extension, and the first sign
            await loop.sock_recv(manager, 4096)
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.0):
                await loop.sock_recv(manager, 4096)
        ticks += 1
        async with asyncio.timeout(PATIENCE_S):
            assert b"WATCHDOG=1" in await loop.sock_recv(manager, 4096)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@pytest.mark.anyio
async def test_status_is_told_only_when_it_is_another(manager: socket.socket) -> None:
    manager.setblocking(False)
    loop, versions = asyncio.get_running_loop(), asyncio.Queue[int]()
    said = iter(["one", "one", "two"])

    async def changed(_: int | None) -> int:
        return await versions.get()

    async with Service(Notifier(manager.getsockname())) as service:
        for _ in range(2):  # starting, and its extension
            await loop.sock_recv(manager, 4096)
        service.on_event(HostStarted("spot"))
        assert await loop.sock_recv(manager, 4096) == b"READY=1\n"
        task = asyncio.create_task(service.told(lambda: next(said), changed))
        for version in range(3):
            versions.put_nowait(version)
        async with asyncio.timeout(PATIENCE_S):
            got = [await loop.sock_recv(manager, 4096) for _ in range(2)]
        assert got == [b"STATUS=one\n", b"STATUS=two\n"]
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
