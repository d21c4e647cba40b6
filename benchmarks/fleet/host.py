"""A process that is one host or several, or the router: `host KIND`. It reads what it is and then
commands line by line, and tells what that took."""

from __future__ import annotations

import asyncio
import itertools
import json
import random
import sys
import time
from typing import Any

from benchmarks.fleet.bare import be_bare
from benchmarks.fleet.told import CATALOGUE, NEWS, tell, usage

from nondum.transport.fleet import Fleet, FleetEvent, Mesh, PeerChanged
from nondum.transport.peers import HostKeys, Identity, IncomingCall, Lease, PeerKey, PeerLost, Trust
from nondum_host_zenoh.fleet import ZenohFleet
from nondum_host_zenoh.line import RouterAccess

BUSY_S = 1.0
"""Between two changes of every host while all are busy."""


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


class Host:
    """One host of a fleet."""

    def __init__(self, kind: str, config: dict[str, Any]) -> None:
        keys = HostKeys(PeerKey(config["public"]), config["secret"])
        identity, trust = Identity(config["name"], keys), Trust(paired=config["trusted"])
        self.watching = Watching()
        self.watching.expected = len(config["trusted"]) - 1
        self.fleet: Fleet
        if kind == "mesh":
            listen = ["tcp://127.0.0.1:0"]
            hear = self.watching.hear
            self.fleet = Mesh(identity, trust, Silent(), on_event=hear, listen=listen)
        else:
            access = RouterAccess("bench", (config["router"],))
            hear = self.watching.hear
            self.fleet = ZenohFleet(identity, trust, Silent(), access, on_event=hear)
        self.fleet.publish(CATALOGUE)

    async def listen(self) -> str:
        """Where it can be met; empty by way of a router, where it is not to be seen yet."""
        if not isinstance(self.fleet, Mesh):
            return ""
        await self.fleet.start()
        return self.fleet.addresses[0]

    async def meet(self, places: dict[str, str]) -> None:
        """Meet all others, until all of their catalogues are here."""
        if isinstance(self.fleet, Mesh):
            for key, address in places.items():
                self.fleet.meet(PeerKey(key), [address])
        else:
            await self.fleet.start()
        await self.watching.told.get()


async def be_hosts(kind: str, configs: list[dict[str, Any]]) -> None:
    """Some hosts, which all do as told, but for what is published: that is the first one's."""
    loop = asyncio.get_running_loop()
    hosts = [Host(kind, config) for config in configs]
    tell({"addresses": [await host.listen() for host in hosts]})
    telling: list[asyncio.Task[None]] = []
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        order = json.loads(line)
        match order["do"]:
            case "meet":
                await asyncio.gather(*(host.meet(order["places"]) for host in hosts))
                tell(_taken(hosts))
            case "look":
                tell(_taken(hosts))
            case "be busy":
                telling = [asyncio.create_task(tell_changes(host.fleet)) for host in hosts]
            case "rest":
                for task in telling:
                    task.cancel()
            case "publish":
                hosts[0].fleet.publish(NEWS)
            case "hear":
                await asyncio.gather(*(host.watching.told.get() for host in hosts))
                tell(_taken(hosts))


def _taken(hosts: list[Host]) -> dict[str, Any]:
    return usage() | {"lost": [lost for host in hosts for lost in host.watching.lost]}


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
        tell({"addresses": [endpoint]})
        while sys.stdin.readline():
            tell(usage())


if __name__ == "__main__":
    (kind,) = sys.argv[1:]
    config = json.loads(sys.stdin.readline())
    if kind == "router":
        be_router(config)
    elif kind == "bare":
        be_bare(*config)
    else:
        asyncio.run(be_hosts(kind, config))
