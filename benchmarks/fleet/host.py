"""A process that is one host, or the router: `host KIND CONFIG`. It reads commands line by
line, and tells what that took."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import os
import random
import socket
import struct
import sys
import time
from pathlib import Path
from typing import Any

from benchmarks import measuring

from nondum.transport.fleet import Fleet, FleetEvent, Mesh, PeerChanged
from nondum.transport.peers import HostKeys, Identity, IncomingCall, Lease, PeerKey, PeerLost, Trust
from nondum_host_zenoh.fleet import ZenohFleet
from nondum_host_zenoh.line import RouterAccess

CATALOGUE = {f"component/{number}": {"text": "x" * 970} for number in range(10)}
NEWS = {"component/9": {"text": "y" * 200}}
BUSY_S = 1.0
"""Between two changes of every host while all are busy."""
# struct tcp_info of linux/tcp.h: bytes_sent comes after 200 bytes.
_TCP_INFO = struct.Struct("=200xQ")


class Silent:
    """Serves nothing."""

    def serve(self, incoming: IncomingCall) -> Any:
        return {}

    def notice(self, *_: Any) -> None: ...

    def orphaned(self, *_: Any) -> Lease:
        return Lease.STOP


class Watching:
    """Counts whose catalogues are there, and who has told the news."""

    def __init__(self) -> None:
        self.complete: set[PeerKey] = set()
        self.lost: list[tuple[float, str, str]] = []
        """When, who, and why."""
        self.told: asyncio.Queue[str] = asyncio.Queue()
        self.expected = 0

    def hear(self, event: FleetEvent) -> None:
        match event:
            case PeerLost():
                self.lost.append((time.monotonic(), event.name, event.reason.name))
                self.complete.discard(event.key)
            case PeerChanged(is_whole=True):
                if len(event.changes) == len(CATALOGUE):
                    self.complete.add(event.key)
                if len(self.complete) == self.expected:
                    self.told.put_nowait("converged")
            case PeerChanged():
                self.told.put_nowait("news")


def duplicate(descriptor: int) -> socket.socket:
    """The socket of a descriptor once more. Raises `OSError` where there is none."""
    copy = os.dup(descriptor)
    try:
        return socket.socket(fileno=copy)
    except OSError:
        os.close(copy)
        raise


def bytes_sent() -> int:
    """What has left by all TCP connections that this process has."""
    total = 0
    for name in os.listdir("/proc/self/fd"):  # noqa: PTH208  # numbers, not paths
        with contextlib.suppress(OSError), duplicate(int(name)) as one:  # or none of TCP
            info = one.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _TCP_INFO.size)
            total += int(_TCP_INFO.unpack(info)[0])
    return total


def rss_mb() -> float:
    fields = Path("/proc/self/statm").read_text(encoding="ascii").split()
    return int(fields[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def usage() -> dict[str, Any]:
    return {
        "at_s": time.monotonic(),
        "cpu_s": measuring.cpu_s(),
        "sent": bytes_sent(),
        "rss_mb": rss_mb(),
    }


async def be_host(kind: str, config: dict[str, Any]) -> None:
    """One host: reads commands line by line, and prints what it took."""
    loop, watching = asyncio.get_running_loop(), Watching()
    keys = HostKeys(PeerKey(config["public"]), config["secret"])
    identity, trust = Identity(config["name"], keys), Trust(paired=config["trusted"])
    watching.expected = len(config["trusted"]) - 1
    fleet: Fleet
    if kind == "mesh":
        fleet = Mesh(
            identity, trust, Silent(), on_event=watching.hear, listen=["tcp://127.0.0.1:0"]
        )
    else:
        access = RouterAccess("bench", (config["router"],))
        fleet = ZenohFleet(identity, trust, Silent(), access, on_event=watching.hear)
    fleet.publish(CATALOGUE)
    if isinstance(fleet, Mesh):
        await fleet.start()
        tell({"address": fleet.addresses[0]})
    else:
        tell({"address": ""})
    telling: asyncio.Task[None] | None = None
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        order = json.loads(line)
        match order["do"]:
            case "meet":
                if isinstance(fleet, Mesh):
                    for key, address in order["places"].items():
                        fleet.meet(PeerKey(key), [address])
                else:
                    await fleet.start()
                await watching.told.get()
                tell(usage() | {"lost": watching.lost})
            case "look":
                tell(usage() | {"lost": watching.lost})
            case "be busy":
                telling = asyncio.create_task(tell_changes(fleet))
            case "rest":
                assert telling is not None
                telling.cancel()
            case "publish":
                fleet.publish(NEWS)
            case "hear":
                await watching.told.get()
                tell(usage())


async def tell_changes(fleet: Fleet) -> None:
    """One after the other, not in step with other hosts."""
    await asyncio.sleep(random.uniform(0.0, BUSY_S))
    for number in itertools.count():
        fleet.publish({"component/9": {"text": "z" * 200, "number": number}})
        await asyncio.sleep(BUSY_S)


def be_router(endpoint: str) -> None:
    import zenoh

    config = zenoh.Config()
    for name, value in {
        "mode": "router",
        "listen/endpoints": [endpoint],
        "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
    }.items():
        config.insert_json5(name, json.dumps(value))
    with zenoh.open(config):
        tell({"address": endpoint})
        while sys.stdin.readline():
            tell(usage())


def tell(what: dict[str, Any]) -> None:
    print(json.dumps(what), flush=True)


if __name__ == "__main__":
    kind, config = sys.argv[1:]
    if kind == "router":
        be_router(json.loads(config))
    else:
        asyncio.run(be_host(kind, json.loads(config)))
