"""Hosts that look for each other, for the tests.

They run in this process, or each in a separate process in a network namespace.

python -m tests.transport.discovery.hosts CONFIG     # looks until its standard input ends
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import queue
import socket
import subprocess
import sys
import threading
from collections import deque
from collections.abc import AsyncIterator, Callable
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from demo.namespaces import Machine
from tests.kit.on_machine import started

from nondum.transport.discovery import Announcement, Discovery, Hint
from nondum.transport.peers.keys import HostKeys, PeerKey

PATIENCE_S = 60.0


@dataclass
class Seeker:
    """A host in this process, and the hints that it got."""

    announcement: Announcement
    discovery: Discovery = field(init=False)
    hints: asyncio.Queue[Hint] = field(default_factory=asyncio.Queue)
    gone: asyncio.Queue[PeerKey] = field(default_factory=asyncio.Queue)

    async def told(self, wanted: Callable[[Hint], bool]) -> Hint:
        """Wait for a hint."""
        async with asyncio.timeout(PATIENCE_S):
            while True:
                hint = await self.hints.get()
                if wanted(hint):
                    return hint

    async def lost(self, key: PeerKey) -> None:
        """Wait until nothing hints at a host any more."""
        async with asyncio.timeout(PATIENCE_S):
            while await self.gone.get() != key:
                pass

    async def found(self, other: Seeker) -> Hint:
        """Wait for a hint about another host."""
        return await self.told(lambda hint: hint.key == other.announcement.key)


def free_port() -> int:
    """A port that no program uses, neither for TCP nor for UDP."""
    while True:
        with (
            socket.create_server(("127.0.0.1", 0)) as tcp,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp,
        ):
            port: int = tcp.getsockname()[1]
            with contextlib.suppress(OSError):
                udp.bind(("127.0.0.1", port))
                return port


def here(name: str, *, epoch: int = 1, key: str = "") -> Announcement:
    """A host that listens on this machine only, with a new key unless one is given."""
    known = PeerKey(key) if key else HostKeys.generate().public
    return Announcement(known, name, epoch, (f"tcp://127.0.0.1:{free_port()}",))


@contextlib.asynccontextmanager
async def seeking(announcement: Announcement, **options: Any) -> AsyncIterator[Seeker]:
    """A host that looks for others until the end of the block; `options` are `Discovery`'s."""
    seeker = Seeker(announcement)
    seeker.discovery = Discovery(
        announcement, on_hint=seeker.hints.put_nowait, on_gone=seeker.gone.put_nowait, **options
    )
    await seeker.discovery.start()
    try:
        yield seeker
    finally:
        await seeker.discovery.close()


class Host:
    """A host on a separate machine (network namespace), and the hints that it got."""

    def __init__(self, machine: Machine, **config: Any) -> None:
        """`config`: static, multicast, port, key, epoch."""
        self.name = machine.name
        self._process = started(
            machine,
            "tests.transport.discovery.hosts",
            json.dumps({"name": machine.name, **config}),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._told: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()
        self._early: deque[dict[str, Any]] = deque()
        """What it was told of while it was starting still."""
        while (told := self._told.get(timeout=PATIENCE_S))["event"] != "started":
            self._early.append(told)
        self.key = told["key"]

    def next(self, event: str, **wanted: Any) -> dict[str, Any]:
        """Wait for an event with these values; others before it are dropped."""
        while True:
            told = self._early.popleft() if self._early else self._told.get(timeout=PATIENCE_S)
            if told["event"] == event and wanted.items() <= told.items():
                return told

    def hears(self, other: Host) -> dict[str, Any]:
        """Wait for a hint about another host."""
        return self.next("hint", key=other.key)

    def loses(self, other: Host) -> None:
        """Wait until nothing hints at another host any more."""
        self.next("gone", key=other.key)

    def finds_addresses(self, other: Host, addresses: set[str]) -> None:
        """Wait until another host is hinted to be at these addresses and no others."""
        while set(self.hears(other)["addresses"]) != addresses:
            pass

    def status(self) -> dict[str, Any]:
        """What it has done and met."""
        self._say("status")
        return self.next("status")

    def announced_s(self) -> float:
        """When it was last announced, on its own clock."""
        return max(row["announced_s"] or 0.0 for row in self.status()["interfaces"])

    def rename(self, name: str) -> None:
        """Have it announce another name."""
        self._say(f"announce {name}")

    def leave(self) -> None:
        """Have it say goodbye and end."""
        self._say("close")
        self._process.wait(PATIENCE_S)
        self._reader.join()

    def kill(self) -> None:
        """End it without a word."""
        self._process.kill()
        self._process.wait(PATIENCE_S)
        self._reader.join()

    def _say(self, line: str) -> None:
        stdin = self._process.stdin
        assert stdin is not None
        stdin.write(f"{line}\n")
        stdin.flush()

    def _read(self) -> None:
        stdout = self._process.stdout
        assert stdout is not None
        for line in stdout:
            self._told.put(json.loads(line))


async def _serve(config: dict[str, Any]) -> None:
    announced = Announcement(
        PeerKey(config.get("key") or HostKeys.generate().public),
        config["name"],
        config.get("epoch", 1),
        (f"tcp://[::]:{config.get('port', 7410)}",),
    )
    discovery = Discovery(
        announced,
        on_hint=lambda hint: _tell("hint", {**asdict(hint), "source": hint.source.value}),
        on_gone=lambda key: _tell("gone", {"key": key}),
        static=config.get("static", ()),
        multicast=config.get("multicast", True),
    )
    await discovery.start()
    _tell("started", {"key": announced.key})
    loop = asyncio.get_running_loop()
    while line := (await loop.run_in_executor(None, sys.stdin.readline)).split():
        match line:
            case ["status"]:
                _tell("status", asdict(discovery.status()))
            case ["announce", name]:
                discovery.announce(replace(announced, name=name))
            case ["close"]:
                break
    await discovery.close()


def _tell(event: str, fields: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps({"event": event, **fields}) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    asyncio.run(_serve(json.loads(sys.argv[1])))
