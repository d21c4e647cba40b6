"""Hosts for the tests: real nodes on loopback, in this process or in a separate one.

python -m tests.transport.peers.hosts CONFIG        # serves until it is killed
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import json
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from nondum.host.peers.links.process import LinksProcess
from nondum.sdk.errors import Problem
from nondum.sdk.wire import Body
from nondum.transport.peers import (
    Admission,
    CallFailed,
    HostKeys,
    Identity,
    IncomingCall,
    Lease,
    Loss,
    PeerEvent,
    PeerKey,
    PeerLost,
    PeerNode,
    PeerUp,
    Reason,
    Refusal,
    Trust,
)
from nondum.transport.peers.local_sockets import LocalSockets
from nondum.transport.peers.socket_process.sockets import SocketProcess
from nondum.transport.peers.sockets import MakeSockets

ROOT = Path(__file__).parents[3]
PATIENCE_S = 60.0
E = TypeVar("E", bound=PeerEvent)
KINDS: Mapping[str, MakeSockets] = {
    "in the daemon": LocalSockets,
    "apart": functools.partial(SocketProcess, start=LinksProcess),
}
SOCKETS: MakeSockets = LocalSockets
"""Of each `host`; the fixture `each_kind_of_sockets` exchanges it."""


@dataclass
class Servant:
    """Carries out what the tests ask for, and remembers it."""

    lease: Lease = Lease.STOP
    served: list[str] = field(default_factory=list)
    notices: asyncio.Queue[dict[str, Any]] = field(default_factory=asyncio.Queue)
    running: asyncio.Queue[IncomingCall] = field(default_factory=asyncio.Queue)
    ended: asyncio.Queue[str] = field(default_factory=asyncio.Queue)
    lost: asyncio.Queue[Loss] = field(default_factory=asyncio.Queue)
    gate: asyncio.Event = field(default_factory=asyncio.Event)

    def serve(self, incoming: IncomingCall) -> Body | Awaitable[Body]:
        self.served.append(str(incoming.args.get("tag", incoming.method)))
        match incoming.method:
            case "echo":
                return incoming.args
            case "wait":
                return self.wait(incoming)
            case "count":
                return self.count(incoming)
            case "hang":
                time.sleep(incoming.args["seconds"])
                return {}
            case "long":
                return {"text": "x" * 1_000_000}
            case "break":
                raise ValueError("broken")
        raise CallFailed(Problem("NO_METHOD", f"no handler serves {incoming.method}"))

    async def wait(self, incoming: IncomingCall) -> Body:
        self.running.put_nowait(incoming)
        try:
            opened = asyncio.ensure_future(self.gate.wait())
            orphaned = asyncio.ensure_future(incoming.orphaned.wait())
            await asyncio.wait({opened, orphaned}, return_when=asyncio.FIRST_COMPLETED)
            orphaned.cancel()
            await opened
        except asyncio.CancelledError:
            self.ended.put_nowait("cancelled")
            raise
        self.ended.put_nowait("finished")
        return {"waited": True}

    async def count(self, incoming: IncomingCall) -> Body:
        for number in range(incoming.args["to"]):
            incoming.progress({"number": number})
            await asyncio.sleep(0)
        return {"counted": incoming.args["to"]}

    def notice(self, caller: Admission, method: str, args: dict[str, Any]) -> None:
        self.notices.put_nowait({"from": caller.name, "method": method, **args})

    def orphaned(self, incoming: IncomingCall, reason: Loss) -> Lease:
        self.lost.put_nowait(reason)
        return self.lease


@dataclass
class Host:
    """A node and what it told."""

    node: PeerNode
    servant: Servant
    address: str = ""
    events: asyncio.Queue[PeerEvent] = field(default_factory=asyncio.Queue)
    linked: dict[PeerKey, asyncio.Event] = field(default_factory=lambda: defaultdict(asyncio.Event))
    refused: asyncio.Event = field(default_factory=asyncio.Event)

    @property
    def key(self) -> PeerKey:
        return self.node.identity.key

    def hear(self, event: PeerEvent) -> None:
        self.events.put_nowait(event)
        match event:
            case PeerUp():
                self.linked[event.key].set()
            case PeerLost():
                self.linked[event.key].clear()
            case Refusal():
                self.refused.set()

    async def counted(self, reason: Reason, times: int = 1) -> None:
        """Wait until `times` connections were turned away for a reason."""
        async with asyncio.timeout(PATIENCE_S):
            while self.node.refusals.counts.get(reason, 0) < times:
                self.refused.clear()
                await self.refused.wait()

    async def told(self, kind: type[E], key: PeerKey | None = None) -> E:
        """Wait for the next event of a kind; others before it are dropped."""
        async with asyncio.timeout(PATIENCE_S):
            while True:
                event = await self.events.get()
                if isinstance(event, kind) and key in (None, getattr(event, "key", None)):
                    return event


def identity(name: str, keys: HostKeys | None = None, certificate: bytes = b"") -> Identity:
    return Identity(name, keys or HostKeys.generate(), certificate)


def trusting(*identities: Identity) -> Trust:
    return Trust(paired={one.key: one.name for one in identities})


@contextlib.asynccontextmanager
async def host(
    me: Identity, trust: Trust | None = None, *, address: str = "tcp://127.0.0.1:0"
) -> AsyncIterator[Host]:
    """A host that listens, until the end of the block."""
    servant = Servant()
    node = PeerNode(
        me,
        trust or Trust(),
        servant,
        on_event=lambda event: found.hear(event),
        sockets=SOCKETS,
    )
    found = Host(node, servant)
    try:
        (found.address,) = await node.start([address])
        yield found
    finally:
        await node.close()


@contextlib.asynccontextmanager
async def two_hosts() -> AsyncIterator[tuple[Host, Host]]:
    """A rover that has dialled a base, both up."""
    rover, base = identity("rover"), identity("base")
    async with host(base, trusting(rover)) as there, host(rover, trusting(base)) as here:
        here.node.dial(there.key, [there.address])
        await up(here, there)
        yield here, there


async def up(one: Host, other: Host) -> None:
    """Wait until two hosts can call each other."""
    async with asyncio.timeout(PATIENCE_S):
        await one.linked[other.key].wait()
        await other.linked[one.key].wait()


@dataclass
class Child:
    """A host in a separate process."""

    process: subprocess.Popen[str]
    key: PeerKey
    address: str


@contextlib.contextmanager
def child(
    keys: HostKeys, trusted: Sequence[Identity], *, port: int = 0, dial: Sequence[str] = ()
) -> Iterator[Child]:
    """Start a host in a process; killed at the end of the block, whatever became of it."""
    config = {
        "public": keys.public,
        "secret": keys.secret,
        "trusted": {one.key: one.name for one in trusted},
        "address": f"tcp://127.0.0.1:{port}",
        "dial": list(dial),
    }
    command = [sys.executable, "-m", "tests.transport.peers.hosts", json.dumps(config)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            address = process.stdout.readline().strip()
            yield Child(process, keys.public, address)
        finally:
            process.kill()


async def _serve(config: dict[str, Any]) -> None:
    keys = HostKeys(PeerKey(config["public"]), config["secret"])
    trust = Trust(paired={PeerKey(key): name for key, name in config["trusted"].items()})
    node = PeerNode(Identity("child", keys), trust, Servant(), on_event=lambda _: None)
    (bound,) = await node.start([config["address"]])
    for key in config["trusted"]:
        if config["dial"]:
            node.dial(PeerKey(key), config["dial"])
    sys.stdout.write(f"{bound}\n")
    sys.stdout.flush()
    await asyncio.Event().wait()


async def raises(call: Callable[[], Awaitable[Any]]) -> list[str]:
    """The codes that a call fails with."""
    try:
        await call()
    except Exception as error:
        return [problem.code for problem in getattr(error, "problems", ())] or [repr(error)]
    return []


if __name__ == "__main__":
    asyncio.run(_serve(json.loads(sys.argv[1])))
