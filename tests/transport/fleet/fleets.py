"""Fleets for the tests: what a host's daemon would see of its peers, remembered.

python -m tests.transport.fleet.fleets KIND CONFIG        # serves until it is killed
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, TypeVar

import zenoh
from tests.transport.peers.hosts import Servant

from nondum.sdk.wire import Body
from nondum.transport.fleet import Fleet, FleetEvent, Mesh, PeerChanged
from nondum.transport.fleet.mesh import Find
from nondum.transport.peers import HostKeys, Identity, PeerKey, PeerLost, PeerUp, Refusal, Trust
from nondum_host_zenoh.fleet import ZenohFleet
from nondum_host_zenoh.line import RouterAccess

ROOT = Path(__file__).parents[3]
PATIENCE_S = 60.0
E = TypeVar("E", bound=FleetEvent)


@dataclass
class Member:
    """A host of a fleet, and what it was told."""

    name: str
    fleet: Fleet
    servant: Servant
    events: list[FleetEvent] = field(default_factory=list)
    seen: dict[PeerKey, dict[str, Body]] = field(default_factory=dict)
    """The catalogues as the events told them: the model that `peers` must agree with."""
    _read: int = 0
    _news: asyncio.Event = field(default_factory=asyncio.Event)

    @property
    def key(self) -> PeerKey:
        return self.fleet.key

    def hear(self, event: FleetEvent) -> None:
        self.events.append(event)
        match event:
            case PeerUp(key=key):
                assert key not in self.seen, "a peer came up twice"
            case PeerLost(key=key):
                self.seen.pop(key, None)
            case PeerChanged(key=key, changes=changes, is_whole=is_whole):
                assert is_whole or key in self.seen, "the first change after PeerUp is whole"
                entries = {} if is_whole else self.seen[key]
                for name, entry in changes.items():
                    if entry is None:
                        del entries[name]
                    else:
                        entries[name] = entry
                self.seen[key] = entries
        self._news.set()

    async def until(self, holds: Callable[[], bool]) -> None:
        """Wait for something that events bring about."""
        async with asyncio.timeout(PATIENCE_S):
            while not holds():
                self._news.clear()
                await self._news.wait()

    async def told(self, kind: type[E], key: PeerKey | None = None) -> E:
        """Wait for the next event of a kind; others before it are dropped."""
        async with asyncio.timeout(PATIENCE_S):
            while True:
                while self._read < len(self.events):
                    event = self.events[self._read]
                    self._read += 1
                    if isinstance(event, kind) and key in (None, getattr(event, "key", None)):
                        return event
                self._news.clear()
                await self._news.wait()

    async def sees(self, other: Member | PeerKey, entries: Mapping[str, Body]) -> None:
        """Wait until the catalogue of another host is known to be this."""
        key = other if isinstance(other, str) else other.key
        await self.until(lambda: self.seen.get(key) == entries)
        assert self.fleet.peers[key].entries == entries


class World(Protocol):
    """Where fleets of one kind live."""

    def member(
        self, name: str, keys: HostKeys | None = None
    ) -> contextlib.AbstractAsyncContextManager[Member]:
        """A host that has started, and is to meet all others of this world."""

    def child(
        self, name: str, keys: HostKeys, entries: Mapping[str, Body]
    ) -> contextlib.AbstractContextManager[subprocess.Popen[str]]:
        """A host in a separate process."""

    def close(self) -> None:
        """End what was between the hosts."""


@dataclass
class MeshWorld:
    """Every host trusts every other by a table that the world keeps, and is told where it is."""

    members: list[Member] = field(default_factory=list)
    names: dict[PeerKey, str] = field(default_factory=dict)
    places: dict[PeerKey, str] = field(default_factory=dict)

    @contextlib.asynccontextmanager
    async def member(self, name: str, keys: HostKeys | None = None) -> AsyncIterator[Member]:
        keys = keys or HostKeys.generate()
        self._know(keys.public, name)
        mesh, found = mesh_member(name, keys, Trust(paired=self.names))
        await mesh.start()
        self.members.append(found)
        self._place(keys.public, mesh.addresses[0])
        for key, address in self.places.items():
            mesh.meet(key, [address])
        try:
            yield found
        finally:
            self.members.remove(found)
            await mesh.close()

    @contextlib.contextmanager
    def child(
        self, name: str, keys: HostKeys, entries: Mapping[str, Body]
    ) -> Iterator[subprocess.Popen[str]]:
        self._know(keys.public, name)
        config = {"trusted": self.names, "places": self.places}
        with process("mesh", name, keys, entries, config) as (started, address):
            self._place(keys.public, address)
            yield started

    def close(self) -> None:
        assert not self.members

    def _know(self, key: PeerKey, name: str) -> None:
        self.names[key] = name
        for one in self.members:
            assert isinstance(one.fleet, Mesh)
            one.fleet.set_trust(Trust(paired=dict(self.names)))

    def _place(self, key: PeerKey, address: str) -> None:
        self.places[key] = address
        for one in self.members:
            assert isinstance(one.fleet, Mesh)
            one.fleet.meet(key, [address])


@dataclass
class ZenohWorld:
    """A router on loopback, and a table of trust that the world keeps."""

    names: dict[PeerKey, str] = field(default_factory=dict)
    members: list[ZenohFleet] = field(default_factory=list)
    port: int = 0

    def __post_init__(self) -> None:
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        self.router = router(self.port)

    @property
    def access(self) -> RouterAccess:
        return RouterAccess("test", (f"tcp/127.0.0.1:{self.port}",))

    @contextlib.asynccontextmanager
    async def member(self, name: str, keys: HostKeys | None = None) -> AsyncIterator[Member]:
        keys = keys or HostKeys.generate()
        self._know(keys.public, name)
        fleet, found = zenoh_member(name, keys, Trust(paired=dict(self.names)), self.access)
        await fleet.start()
        self.members.append(fleet)
        try:
            yield found
        finally:
            self.members.remove(fleet)
            await fleet.close()

    @contextlib.contextmanager
    def child(
        self, name: str, keys: HostKeys, entries: Mapping[str, Body]
    ) -> Iterator[subprocess.Popen[str]]:
        self._know(keys.public, name)
        config = {"trusted": self.names, "endpoint": self.access.endpoints[0]}
        with process("zenoh", name, keys, entries, config) as (started, _):
            yield started

    def close(self) -> None:
        self.router.close()  # type: ignore[no-untyped-call]  # so it is in Zenoh's stubs

    def _know(self, key: PeerKey, name: str) -> None:
        self.names[key] = name
        for fleet in self.members:
            fleet.set_trust(Trust(paired=dict(self.names)))


def router(port: int) -> zenoh.Session:
    config = zenoh.Config()
    for name, value in {
        "mode": "router",
        "listen/endpoints": [f"tcp/127.0.0.1:{port}"],
        "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
    }.items():
        config.insert_json5(name, json.dumps(value))
    return zenoh.open(config)


def zenoh_member(
    name: str, keys: HostKeys | None, trust: Trust, access: RouterAccess
) -> tuple[ZenohFleet, Member]:
    servant = Servant()
    fleet = ZenohFleet(
        Identity(name, keys), trust, servant, access, on_event=lambda event: found.hear(event)
    )
    found = Member(name, fleet, servant)
    return fleet, found


def mesh_member(
    name: str,
    keys: HostKeys | None,
    trust: Trust,
    *,
    listen: str = "tcp://127.0.0.1:0",
    find: Find | None = None,
) -> tuple[Mesh, Member]:
    servant = Servant()
    mesh = Mesh(
        Identity(name, keys),
        trust,
        servant,
        on_event=lambda event: found.hear(event),
        listen=[listen],
        find=find,
    )
    found = Member(name, mesh, servant)
    return mesh, found


@contextlib.contextmanager
def process(
    kind: str, name: str, keys: HostKeys, entries: Mapping[str, Body], config: dict[str, Any]
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start a host in a process; killed at the end of the block. With what it says first."""
    told = {"name": name, "public": keys.public, "secret": keys.secret, "entries": entries}
    command = [sys.executable, "-m", __spec__.name, kind, json.dumps({**told, **config})]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as started:
        try:
            assert started.stdout is not None
            yield started, started.stdout.readline().strip()
        finally:
            started.kill()


async def _serve_mesh(config: dict[str, Any]) -> None:
    keys = HostKeys(PeerKey(config["public"]), config["secret"])
    mesh, _ = mesh_member(config["name"], keys, Trust(paired=config["trusted"]))
    mesh.publish(config["entries"])
    await mesh.start()
    for key, address in config["places"].items():
        mesh.meet(PeerKey(key), [address])
    sys.stdout.write(f"{mesh.addresses[0]}\n")
    sys.stdout.flush()
    await asyncio.Event().wait()


async def _serve_zenoh(config: dict[str, Any]) -> None:
    keys = HostKeys(PeerKey(config["public"]), config["secret"])
    access = RouterAccess("test", (config["endpoint"],))
    fleet, _ = zenoh_member(config["name"], keys, Trust(paired=config["trusted"]), access)
    fleet.publish(config["entries"])
    await fleet.start()
    sys.stdout.write("started\n")
    sys.stdout.flush()
    await asyncio.Event().wait()


def refusals(member: Member) -> list[Refusal]:
    return [event for event in member.events if isinstance(event, Refusal)]


if __name__ == "__main__":
    serve = {"mesh": _serve_mesh, "zenoh": _serve_zenoh}[sys.argv[1]]
    asyncio.run(serve(json.loads(sys.argv[2])))
