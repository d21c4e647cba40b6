"""One host, as the daemon is one among others: mesh and discovery, with keys, and nothing else.

`python -m benchmarks.peers.member CONFIG` tells what happens to it and when, as JSON, line by line,
and takes orders: `start`, and `hang`, which stops its loop. SIGTERM has it say goodbye.
"""

from __future__ import annotations

import asyncio
import json
import signal
import sys
import time
from collections.abc import Mapping
from typing import Any

from nondum.host.config.host_config import PeersSection
from nondum.host.peers.finder import PeerFinder
from nondum.transport.fleet import FleetEvent, Mesh
from nondum.transport.peers import (
    Admission,
    HostKeys,
    Identity,
    IncomingCall,
    Lease,
    Loss,
    PeerKey,
    PeerLost,
    PeerUp,
    Trust,
)

HANGING_S = 30.0


class Silent:
    """Serves nothing."""

    def serve(self, incoming: IncomingCall) -> dict[str, Any]:
        return {}

    def notice(self, caller: Admission, method: str, args: dict[str, Any]) -> None: ...

    def orphaned(self, incoming: IncomingCall, reason: Loss) -> Lease:
        return Lease.STOP


class TimedFinder:
    """The daemon's, and when it began to look."""

    def __init__(self, mesh: Mesh) -> None:
        self._finder = PeerFinder(mesh, PeersSection())

    async def start(self) -> None:
        begun_s = time.monotonic()
        await self._finder.start()
        tell("started", took_s=time.monotonic() - begun_s)

    async def close(self) -> None:
        await self._finder.close()


def tell(event: str, **more: Any) -> None:
    """At this moment."""
    sys.stdout.write(json.dumps({"event": event, "at_s": time.monotonic(), **more}) + "\n")
    sys.stdout.flush()


def hear(event: FleetEvent) -> None:
    match event:
        case PeerUp():
            tell("up", peer=event.name)
        case PeerLost():
            tell("lost", peer=event.name, reason=event.reason.name.lower())


def hang() -> None:
    tell("hung")
    time.sleep(HANGING_S)


async def be_host(config: Mapping[str, Any]) -> None:
    """Until SIGTERM, or the end of the process that gives orders."""
    loop, started, over = asyncio.get_running_loop(), asyncio.Event(), asyncio.Event()
    mesh = Mesh(
        Identity(config["name"], HostKeys(PeerKey(config["public"]), config["secret"])),
        Trust(paired=config["trusted"]),
        Silent(),
        on_event=hear,
        listen=[config["listen"]],
        find=TimedFinder,
    )
    orders = {"start": started.set, "hang": hang, "": sys.exit}
    loop.add_reader(sys.stdin, lambda: orders[sys.stdin.readline().strip()]())
    loop.add_signal_handler(signal.SIGTERM, over.set)
    tell("ready")
    await started.wait()
    await mesh.start()
    await over.wait()
    await mesh.close()


if __name__ == "__main__":
    asyncio.run(be_host(json.loads(sys.argv[1])))
