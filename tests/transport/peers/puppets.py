"""A process of links that says whatever a test wants."""

from __future__ import annotations

import asyncio
import os
import socket
from typing import Any

from nondum.transport.peers.apart.pipe import Pipe
from nondum.transport.peers.apart.service import MOST_WAITING

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
