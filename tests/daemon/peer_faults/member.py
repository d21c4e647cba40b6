"""One host of a fleet, on its own machine: it changes its catalogue, calls others, serves their
calls by writing down what it does, and reports what it sees.

python -m tests.daemon.peer_faults.member CONFIG     # until it is told to leave

Orders come as JSON, one a line: {"id": 1, "do": "see", …}; answers and events leave likewise.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import json
import logging
import os
import random
import sys
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from nondum.host.config.host_config import PeersSection
from nondum.host.peers.finder import PeerFinder
from nondum.sdk.errors import NondumError, Problem
from nondum.sdk.wire import Body
from nondum.transport.fleet import FleetEvent, Mesh, PeerChanged
from nondum.transport.peers import (
    Admission,
    CallFailed,
    DialFailed,
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
from nondum.transport.peers.allowance import USUAL, Allowance
from nondum.transport.peers.certificate import FleetKey

KEYS = 20
"""Entries that come and go."""
LONG = 30_000
"""Bytes of the longest entry: a few of them make a catalogue of several messages."""
DEADLINE_S = 4.0
ALLOWANCE = Allowance(USUAL.per_s / 10, USUAL.burst / 4)
"""Lower than usual, so that a slow machine, too, can exceed it."""
ENDINGS = {"work.stop": Lease.STOP, "work.finish": Lease.FINISH, "work.hold": Lease.HOLD}
"""What becomes of a piece of work whose caller is lost."""

Order = Callable[..., Awaitable[Mapping[str, Any]]]


class Works:
    """Serves calls: writes down when a piece of work begins and ends."""

    def __init__(self) -> None:
        self._log = -1
        self.running: set[str] = set()
        self.idle = asyncio.Event()
        self.idle.set()
        self.noticed = 0

    def open(self, log: Path) -> None:
        """Write to a file of this life."""
        self._log = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_EXCL)

    def serve(self, incoming: IncomingCall) -> Body | Awaitable[Body]:
        if incoming.method == "echo":
            return incoming.args
        if incoming.method in ENDINGS:
            return self._work(incoming)
        raise CallFailed(Problem("NO_METHOD", incoming.method))

    def notice(self, caller: Admission, method: str, args: dict[str, Any]) -> None:
        self.noticed += 1

    def orphaned(self, incoming: IncomingCall, reason: Loss) -> Lease:
        return ENDINGS.get(incoming.method, Lease.STOP)

    async def _work(self, incoming: IncomingCall) -> Body:
        piece = incoming.args["piece"]
        self.running.add(piece)
        self.idle.clear()
        self._write("begin", piece)
        try:
            await asyncio.sleep(incoming.args["for_s"])
        finally:
            self._write("end", piece)
            self.running.discard(piece)
            if not self.running:
                self.idle.set()
        return {"piece": piece}

    def _write(self, word: str, piece: str) -> None:
        os.write(self._log, f"{word} {piece}\n".encode())


class Asks:
    """Calls others, one piece of work after the other, and remembers what became of them."""

    def __init__(self, mesh: Mesh, chance: random.Random) -> None:
        self._mesh, self._chance = mesh, chance
        self._asking: asyncio.Task[None] | None = None
        self._open: set[asyncio.Task[None]] = set()
        self.asked = 0
        self.answered: list[str] = []
        self.failed: Counter[str] = Counter()

    def start(self, every_s: float) -> None:
        self._asking = asyncio.create_task(self._go_on(every_s))

    async def stop(self) -> None:
        """Ask no more, and wait for what is open."""
        if self._asking is not None:
            self._asking.cancel()
        await asyncio.gather(*self._open)

    async def _go_on(self, every_s: float) -> None:
        while True:
            await asyncio.sleep(every_s * self._chance.uniform(0.5, 1.5))
            if peers := sorted(self._mesh.peers):
                task = asyncio.create_task(self._ask(self._chance.choice(peers)))
                self._open.add(task)
                task.add_done_callback(self._open.discard)

    async def _ask(self, peer: PeerKey) -> None:
        self.asked += 1
        piece = f"{self._mesh.name}-{self._mesh.epoch}-{self.asked}"
        # Some take longer than a link is given up after.
        for_s = self._chance.choice([0.0, 0.0, 0.01, 0.1, 2.0])
        method = self._chance.choice(sorted(ENDINGS))
        try:
            args = {"piece": piece, "for_s": for_s}
            answer = await self._mesh.call(peer, method, args, deadline_s=DEADLINE_S)
        except NondumError as error:
            self.failed[error.code] += 1
        else:
            assert answer == {"piece": piece}
            self.answered.append(piece)


class Changes:
    """Publishes entries that come, change and go; `published` is the model of what is there."""

    def __init__(self, mesh: Mesh, chance: random.Random) -> None:
        self._mesh, self._chance = mesh, chance
        self._number = 0
        self._changing: asyncio.Task[None] | None = None
        self.published: dict[str, Body] = {}

    def start(self, every_s: float) -> None:
        self._changing = asyncio.create_task(self._go_on(every_s))

    def stop(self) -> None:
        if self._changing is not None:
            self._changing.cancel()

    def publish(self, changes: Mapping[str, Body | None]) -> None:
        self._mesh.publish(changes)
        for key, entry in changes.items():
            if entry is None:
                self.published.pop(key, None)
            else:
                self.published[key] = entry

    async def _go_on(self, every_s: float) -> None:
        while True:
            await asyncio.sleep(every_s * self._chance.uniform(0.0, 2.0))
            keys = self._chance.sample(range(KEYS), self._chance.choice([1, 1, 1, 5]))
            self.publish({f"fact/{key}": self._entry() for key in keys})

    def _entry(self) -> Body | None:
        self._number += 1
        length = self._chance.choices([None, 10, LONG], [2, 10, 1])[0]
        return None if length is None else {"number": self._number, "text": "x" * length}


class Sees:
    """The peers' catalogues as events told them: the model that `peers` must agree with."""

    def __init__(self, tell: Callable[..., None]) -> None:
        self._tell = tell
        self.names: dict[PeerKey, str] = {}
        self.catalogues: dict[PeerKey, dict[str, Body]] = {}
        self.changed = 0
        self.lost: Counter[str] = Counter()
        self.met: set[str] = set()
        """Who was ever there."""
        self.news = asyncio.Event()

    def hear(self, event: FleetEvent) -> None:
        match event:
            case PeerUp(key, name, epoch):
                assert key not in self.names, "a peer came up twice"
                self.names[key] = name
                self.met.add(name)
                self._tell("up", peer=name, key=key, epoch=epoch)
            case PeerLost(key, name, reason):
                del self.names[key]
                self.catalogues.pop(key, None)
                self.lost[reason.name] += 1
                self._tell("lost", peer=name, key=key, reason=reason.name)
            case PeerChanged(key, changes, is_whole):
                assert is_whole or key in self.catalogues, "the first change is whole"
                self.changed += 1
                entries = {} if is_whole else self.catalogues[key]
                for name, entry in changes.items():
                    entries.pop(name, None)  # what came and went at once was never known
                    if entry is not None:
                        entries[name] = entry
                self.catalogues[key] = entries
            case DialFailed(key, _, problem):
                self._tell("failed", key=key, code=problem.code)
        self.news.set()


class Complaints(logging.Handler):
    """Reports errors and uncaught exceptions: a test fails if there are any."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)

    def emit(self, record: logging.LogRecord) -> None:
        _tell("broken", what=logging.Formatter().format(record))


class Member:
    """The host, and the orders that it takes."""

    def __init__(self, config: Mapping[str, Any]) -> None:
        chance = random.Random(config["seed"])
        self._skew = timedelta()
        self._works, self._sees = Works(), Sees(_tell)
        section = PeersSection(discover=config["discover"], static=tuple(config["static"]))
        self._trust = _trust(config)
        self.mesh = Mesh(
            _identity(config),
            self._trust,
            self._works,
            on_event=self._sees.hear,
            listen=[f"tcp://*:{config['port']}"],
            find=lambda mesh: PeerFinder(mesh, section),
            clock=lambda: datetime.now(UTC) + self._skew,
            allowance=ALLOWANCE,
        )
        self._works.open(Path(config["log"], f"{self.mesh.name}-{self.mesh.epoch}"))
        self._changes, self._asks = Changes(self.mesh, chance), Asks(self.mesh, chance)
        self._timed: asyncio.Task[list[float]] | None = None
        self._set_clock(config["skew_s"])

    async def run(self) -> None:
        """Take orders until it is to leave."""
        await self.mesh.start()
        _tell("started", epoch=self.mesh.epoch)
        orders: dict[str, Order] = {
            name.removeprefix("order_"): getattr(self, name)
            for name in dir(self)
            if name.startswith("order_")
        }
        loop, tasks = asyncio.get_running_loop(), set()
        while line := await loop.run_in_executor(None, sys.stdin.readline):
            order = json.loads(line)
            number, do = order.pop("id"), order.pop("do")
            if do == "leave":
                break
            task = asyncio.create_task(_obey(number, orders[do](**order)))
            tasks.add(task)
            task.add_done_callback(tasks.discard)
        await self.mesh.close()

    async def order_publish(self, changes: Mapping[str, Body | None]) -> Mapping[str, Any]:
        """Change the catalogue once."""
        self._changes.publish(changes)
        return {}

    async def order_live(self, change_s: float, ask_s: float) -> Mapping[str, Any]:
        """Change entries and call peers from now on, about so often; 0 for never."""
        if change_s:
            self._changes.start(change_s)
        if ask_s:
            self._asks.start(ask_s)
        return {}

    async def order_rest(self) -> Mapping[str, Any]:
        """Make no more calls, and wait for the answers; the results of the calls."""
        await self._asks.stop()
        return {"answered": self._asks.answered, "failed": self._asks.failed}

    async def order_still(self) -> Mapping[str, Any]:
        """Change nothing any more: what was published."""
        self._changes.stop()
        return {"published": self._changes.published}

    async def order_idle(self) -> Mapping[str, Any]:
        """Wait until nothing runs for anybody."""
        await self._works.idle.wait()
        gc.collect()
        return {}

    async def order_see(self, catalogues: Mapping[str, Mapping[str, Body]]) -> Mapping[str, Any]:
        """Wait until exactly these peers are there with these entries."""
        await self._until(lambda: self._seen() == catalogues)
        told = {peer.name: peer.entries for peer in self.mesh.peers.values()}
        assert told == catalogues, "events and `peers` tell different things"
        return {}

    async def order_know(self, peer: str, entries: Mapping[str, Body]) -> Mapping[str, Any]:
        """Wait until one peer is there with exactly these entries."""
        await self._until(lambda: self._seen().get(peer) == entries)
        return {}

    async def order_miss(self, peer: str) -> Mapping[str, Any]:
        """Wait until one peer is not there."""
        await self._until(lambda: peer not in self._sees.names.values())
        return {}

    async def order_be_among(self, peers: list[str]) -> Mapping[str, Any]:
        """Wait until exactly these peers are there."""
        await self._until(lambda: sorted(self._sees.names.values()) == sorted(peers))
        return {}

    async def order_call(
        self, peer: str, method: str, args: Body, deadline_s: float
    ) -> Mapping[str, Any]:
        """Call a peer: `answer`, or the codes of the `failure`."""
        try:
            key = next(key for key, name in self._sees.names.items() if name == peer)
            call = self.mesh.call(key, method, args, deadline_s=deadline_s)
            return {"answer": await call}
        except NondumError as error:
            return {"failure": error.code}

    async def order_time(self, peer: str, every_s: float) -> Mapping[str, Any]:
        """Call a peer from now on, and take the time."""
        key = next(key for key, name in self._sees.names.items() if name == peer)
        self._timed = asyncio.create_task(self._take_times(key, every_s))
        return {}

    async def order_times(self) -> Mapping[str, Any]:
        """Call it no more: how long each call took, in seconds. One that fails, fails this."""
        assert self._timed is not None
        timed, self._timed = self._timed, None
        timed.cancel()
        return {"times": await timed}

    async def order_revoke(self, key: str) -> Mapping[str, Any]:
        """Let in a key no more."""
        self._trust = self._trust.with_revoked(PeerKey(key), "gone bad")
        self.mesh.set_trust(self._trust)
        return {}

    async def order_set_clock(self, skew_s: float) -> Mapping[str, Any]:
        """Put the time of day on or back."""
        self._set_clock(skew_s)
        return {}

    async def order_status(self) -> Mapping[str, Any]:
        """Who is there, what runs, and who was turned away."""
        counts = {reason.name: count for reason, count in self.mesh.refusals.counts.items()}
        return {
            "peers": sorted(self._sees.names.values()),
            "met": sorted(self._sees.met),
            "running": len(self._works.running),
            "noticed": self._works.noticed,
            "changed": self._sees.changed,
            "lost": self._sees.lost,
            "refused": counts,
        }

    async def _take_times(self, peer: PeerKey, every_s: float) -> list[float]:
        loop, times = asyncio.get_running_loop(), []
        with contextlib.suppress(asyncio.CancelledError):
            while True:
                began_s = loop.time()
                await self.mesh.call(peer, "echo", {}, deadline_s=30)
                times.append(loop.time() - began_s)
                await asyncio.sleep(every_s)
        return times

    async def _until(self, holds: Callable[[], bool]) -> None:
        while not holds():
            self._sees.news.clear()
            await self._sees.news.wait()

    def _seen(self) -> dict[str, Mapping[str, Body]]:
        return {name: self._sees.catalogues.get(key, {}) for key, name in self._sees.names.items()}

    def _set_clock(self, skew_s: float) -> None:
        self._skew = timedelta(seconds=skew_s)


def _identity(config: Mapping[str, Any]) -> Identity:
    keys = HostKeys(PeerKey(config["public"]), config["secret"])
    return Identity(config["name"], keys, bytes.fromhex(config["certificate"]))


def _trust(config: Mapping[str, Any]) -> Trust:
    fleets = {FleetKey(key): "fleet" for key in config["fleets"]}
    return Trust(fleets=fleets, paired={PeerKey(k): name for k, name in config["paired"].items()})


async def _obey(number: int, order: Awaitable[Mapping[str, Any]]) -> None:
    try:
        _tell("done", id=number, **await order)
    except Exception as error:
        _tell("done", id=number, error=repr(error))
        raise


def _tell(event: str, **fields: Any) -> None:
    sys.stdout.write(json.dumps({"event": event, **fields}) + "\n")
    sys.stdout.flush()


async def _main(config: Mapping[str, Any]) -> None:
    await Member(config).run()


if __name__ == "__main__":
    logging.getLogger().addHandler(Complaints())
    asyncio.run(_main(json.loads(sys.argv[1])))
