"""A process of links that says whatever a test wants, and a daemon that does."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
from collections.abc import AsyncIterator
from typing import Any

from tests.kit.until import arrived

from nondum.transport.peers import Trust, trust_file
from nondum.transport.peers.socket_process.pipe import Pipe, pipe_sockets
from nondum.transport.peers.socket_process.service import MOST_WAITING, Service

ADDRESS = "tcp://127.0.0.1:7410"


class Puppet:
    """It says that it listens where it is asked to, and nothing else by itself."""

    pid = os.getpid()

    def __init__(self, pipe: socket.socket) -> None:
        self.heard: list[list[Any]] = []
        self.is_closed = asyncio.Event()
        self._pipe = Pipe(pipe.dup(), self._hear, lambda _: self.is_closed.set(), MOST_WAITING)

    async def ended(self, grace_s: float) -> str:
        self._pipe.close()
        return "was a puppet"

    def say(self, *packet: Any) -> None:
        self._pipe.send(*packet)

    def _hear(self, packet: list[Any]) -> None:
        self.heard.append(packet)
        match packet:
            case ["listen", addresses]:
                self.say("listening", addresses)
            case ["tick"]:
                self.say("tock", 0)


class Puppets:
    """Starts them; the last one is asked for by tests."""

    def __init__(self) -> None:
        self.started: list[Puppet] = []

    def __call__(self, pipe: socket.socket) -> Puppet:
        self.started.append(Puppet(pipe))
        return self.started[-1]


class Daemon:
    """The daemon of a host without keys; the process's end is on the same loop."""

    port = 0
    """Where the process listens."""

    def __init__(self, pipe: socket.socket) -> None:
        self._heard: asyncio.Queue[list[Any]] = asyncio.Queue()
        self._pipe = Pipe(pipe, self._heard.put_nowait, lambda _: None, MOST_WAITING)

    def say(self, *packet: Any) -> None:
        self._pipe.send(*packet)

    async def hears(self) -> list[Any]:
        return await arrived("the process tells something", self._heard.get())

    async def begin(self) -> None:
        self.say("trust", trust_file.to_text(Trust()), True)
        self.say("begin", "base", None)
        self.say("listen", ["tcp://127.0.0.1:0"])
        _, (address,) = await self.hears()
        self.port = int(address.rpartition(":")[2])

    def close(self) -> None:
        self._pipe.close()


@contextlib.asynccontextmanager
async def serving() -> AsyncIterator[Daemon]:
    """A daemon, and what serves it until the end of the block."""
    ours, theirs = pipe_sockets()
    daemon, service = Daemon(ours), asyncio.ensure_future(Service(theirs).run())
    await daemon.begin()
    try:
        yield daemon
    finally:
        daemon.say("close")
        await arrived("the process ends", service)
        daemon.close()
