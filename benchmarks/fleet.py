"""Hosts that meet and read each other: `python -m benchmarks.fleet`.

Every host is a separate process, all on this machine over loopback: by mesh (CURVE, every host
linked to every other) and by way of a Zenoh router (a process more, no encryption). All start, and
wait; then they are told of each other at one moment. Measured until every one of them has every
other's catalogue of 10 kB; then for some seconds of quiet, and one change that all must hear of.
In the mesh, hosts are then stopped and killed, while all are quiet and while all tell changes: how
long until all others know, and whether a live one was taken for dead meanwhile.
Writes docs/benchmarks/fleet.md.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import itertools
import json
import math
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import zmq
from benchmarks import measuring
from benchmarks.measuring import Spread

from nondum.transport.fleet import Fleet, FleetEvent, Mesh, PeerChanged
from nondum.transport.peers import HostKeys, Identity, IncomingCall, Lease, PeerKey, PeerLost, Trust
from nondum_host_zenoh.fleet import ZenohFleet
from nondum_host_zenoh.line import RouterAccess

CATALOGUE = {f"component/{number}": {"text": "x" * 970} for number in range(10)}
NEWS = {"component/9": {"text": "y" * 200}}
QUIET_S = 4.0
BUSY_S = 1.0
"""Between two changes of every host while all are busy."""
SEEN_S = 1.0
"""Between two looks whether a death is known to all …"""
PATIENCE_S = 20.0
"""… until so much later."""
TOGETHER = 8
"""Hosts that start at the same time, or their self-tests would be late."""
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
    """One host: told what to do line by line, and tells what it took."""
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


@dataclass
class Child:
    """A process that does as it is told."""

    process: subprocess.Popen[str]
    name: str
    address: str = ""

    def order(self, do: str, **more: Any) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps({"do": do, **more}) + "\n")
        self.process.stdin.flush()

    def answer(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        answer: dict[str, Any] = json.loads(self.process.stdout.readline())
        return answer


@contextlib.contextmanager
def children(kinds: list[tuple[str, Any]]) -> Iterator[list[Child]]:
    with contextlib.ExitStack() as stack:
        started = []
        for kind, config in kinds:
            command = [sys.executable, "-m", "benchmarks.fleet", "--be", kind, json.dumps(config)]
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
            stack.enter_context(process)
            stack.callback(process.kill)
            started.append(Child(process, config["name"] if kind != "router" else kind))
            if len(started) % TOGETHER == 0 or len(started) == len(kinds):
                for one in started[-TOGETHER:]:
                    one.address = one.address or one.answer()["address"] or "-"
        yield started


@dataclass(frozen=True, slots=True)
class Figures:
    """One repeat."""

    converged_s: float
    sent_kb: float
    """By all together, per host."""
    cpu_ms: float
    """Per host, its part of the router's included."""
    rss_mb: float
    quiet_percent: float
    """Of a core, per host."""
    news_ms: float
    news_bytes: float
    """That the host with the news has sent meanwhile."""
    lost: int
    """Live peers that were taken for dead, in all."""
    why: dict[str, int]
    """The reasons that were told for them."""
    deaths_s: dict[str, float]
    """By what happened: until the last host knew that another was dead."""


DEATHS = {
    "quiet, stopped": (False, signal.SIGSTOP),
    "quiet, killed": (False, signal.SIGKILL),
    "busy, stopped": (True, signal.SIGSTOP),
    "busy, killed": (True, signal.SIGKILL),
}


def strike(nodes: list[Child]) -> tuple[dict[str, float], set[str], list[dict[str, Any]]]:
    """Have hosts die, one after the other; how long until all others knew, which ones died, and
    what the others told at the end."""
    took_s, dead, alive = {}, set(), list(nodes)
    is_busy = False
    for what, (wants_busy, number) in DEATHS.items():
        if wants_busy is not is_busy:
            for node in alive:
                node.order("be busy")
            is_busy = True
            time.sleep(QUIET_S)
        struck = alive.pop()
        at_s = time.monotonic()
        struck.process.send_signal(number)
        dead.add(struck.name)
        took_s[what] = max(_known_to(node, struck.name, at_s) for node in alive)
    time.sleep(QUIET_S)
    for node in alive:
        node.order("rest")
    return took_s, dead, _all(alive, lambda node: node.order("look"))


def _has_deaths(kind: str, hosts: int) -> bool:
    return kind == "mesh" and hosts > len(DEATHS) + 1


def _known_to(node: Child, name: str, at_s: float) -> float:
    """How long after a moment a host lost another; infinite when it did not."""
    while True:
        node.order("look")
        for lost_s, lost, _ in node.answer()["lost"]:
            if lost == name and lost_s >= at_s:
                return float(lost_s) - at_s
        if time.monotonic() - at_s > PATIENCE_S:
            return math.inf
        time.sleep(SEEN_S)


def measure(kind: str, hosts: int) -> Figures:
    keys = [HostKeys.generate() for _ in range(hosts)]
    trusted = {pair.public: f"host-{number}" for number, pair in enumerate(keys)}
    with socket.create_server(("127.0.0.1", 0)) as free:
        router = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    configs: list[tuple[str, Any]] = [
        (
            kind,
            {
                "name": trusted[pair.public],
                "public": pair.public,
                "secret": pair.secret,
                "trusted": trusted,
                "router": router,
            },
        )
        for pair in keys
    ]
    with contextlib.ExitStack() as stack:
        relays = []
        if kind == "zenoh":
            relays = stack.enter_context(children([("router", router)]))
        nodes = stack.enter_context(children(configs))
        places = {pair.public: node.address for pair, node in zip(keys, nodes, strict=True)}
        everybody = [*nodes, *relays]
        before = _all(everybody, lambda node: node.order("look"))
        begun_s = time.monotonic()
        for node in nodes:
            node.order("meet", places=places)
        met = [node.answer() for node in nodes]
        after = _all(everybody, lambda node: node.order("look"))
        time.sleep(QUIET_S)
        quiet = _all(everybody, lambda node: node.order("look"))
        for node in nodes[1:]:
            node.order("hear")
        told_s = time.monotonic()
        nodes[0].order("publish")
        heard = [node.answer() for node in nodes[1:]]
        nodes[0].order("look")
        publisher = nodes[0].answer()
        silence = (quiet[0]["sent"] - after[0]["sent"]) / (quiet[0]["at_s"] - after[0]["at_s"])
        took_s, dead, last = (
            strike(nodes) if _has_deaths(kind, hosts) else ({}, set(), quiet[:hosts])
        )
        why = Counter(why for one in last for _, name, why in one["lost"] if name not in dead)
        noise = silence * (publisher["at_s"] - quiet[0]["at_s"])
        return Figures(
            converged_s=max(one["at_s"] for one in met) - begun_s,
            sent_kb=_grown("sent", before, after) / hosts / 1000,
            cpu_ms=_grown("cpu_s", before, after) / hosts * 1000,
            rss_mb=sum(one["rss_mb"] for one in after[:hosts]) / hosts,
            quiet_percent=100
            * _grown("cpu_s", after, quiet)
            / hosts
            / (quiet[0]["at_s"] - after[0]["at_s"]),
            news_ms=(max(one["at_s"] for one in heard) - told_s) * 1000,
            news_bytes=publisher["sent"] - quiet[0]["sent"] - noise,
            lost=why.total(),
            why=dict(why),
            deaths_s=took_s,
        )


def _all(nodes: list[Child], order: Callable[[Child], None]) -> list[dict[str, Any]]:
    for node in nodes:
        order(node)
    return [node.answer() for node in nodes]


def _grown(field: str, before: list[dict[str, Any]], after: list[dict[str, Any]]) -> float:
    pairs = zip(before, after, strict=True)
    return float(sum(late[field] - early[field] for early, late in pairs))


COLUMNS = {
    "all converged: s": ("converged_s", ".2f"),
    "sent, kB per host": ("sent_kb", ",.0f"),
    "CPU ms per host": ("cpu_ms", ",.0f"),
    "RSS MB per host": ("rss_mb", ".0f"),
    "quiet: % of a core per host": ("quiet_percent", ".2f"),
    "a change reaches all: ms": ("news_ms", ".0f"),
    "its bytes": ("news_bytes", ",.0f"),
    "wrongly taken for dead": ("lost", ".0f"),
}


def page(found: dict[tuple[str, int], list[Figures]], repeats: int) -> str:
    named = {"mesh": "mesh, CURVE", "zenoh": "Zenoh router"}
    rows = []
    for (kind, hosts), figures in found.items():
        spreads = (
            format(Spread(tuple(float(getattr(one, field)) for one in figures)), style)
            for field, style in COLUMNS.values()
        )
        rows.append([str(hosts), named[kind], *spreads])
    return f"""# Hosts that meet: mesh against a Zenoh router

`python -m benchmarks.fleet` wrote this page. Every host is a separate process, all on this one
machine over loopback, so that {max(hosts for _, hosts in found)} hosts share what each of them
would have alone. All have started when they are told of each other at one moment; converged means
that every one has every other's catalogue (10 kB, ten entries). Bytes are those that TCP carried,
the router's included; CPU is until then, the router's and ZeroMQ's threads included. In quiet, mesh
links are pinged from both ends, every 0.3 s for up to 32 peers and every 1.8 s for 99; by way of
the router, hosts tell their state every 3 s.
Then one entry of 200 bytes changes: until the last host has it, and what the one that told it has
sent. Live hosts that were taken for dead by another are counted until the end, deaths included. The
mesh is encrypted and every host proves its key; the router's links here are not.
Medians of {repeats} repeats in turn (lowest-highest).

{measuring.table(["hosts", "", *COLUMNS], rows)}

## Deaths

In the mesh, four hosts die one after the other: stopped (SIGSTOP: nothing of them is heard, and
their connections stay) or killed (SIGKILL), while the others are quiet, and while every one of
them changes an entry every {BUSY_S:.0f} s, which all others are told. Seconds until the last of the
others knew.

{measuring.table(["hosts", *DEATHS], _deaths(found))}

Machine: {measuring.machine()}; libzmq {zmq.zmq_version()},
eclipse-zenoh {version("eclipse-zenoh")}.
"""


def _deaths(found: dict[tuple[str, int], list[Figures]]) -> list[list[str]]:
    return [
        [
            str(hosts),
            *(format(Spread(tuple(one.deaths_s[what] for one in some)), ".2f") for what in DEATHS),
        ]
        for (kind, hosts), some in found.items()
        if _has_deaths(kind, hosts)
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--hosts", type=int, nargs="+", default=[2, 32, 100])
    parser.add_argument("--kinds", nargs="+", default=["mesh", "zenoh"])
    parser.add_argument("--be", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.be is not None:
        kind, config = arguments.be
        if kind == "router":
            be_router(json.loads(config))
        else:
            asyncio.run(be_host(kind, json.loads(config)))
        return
    found: dict[tuple[str, int], list[Figures]] = {}
    for hosts in arguments.hosts:
        for _ in range(arguments.repeats):
            for kind in arguments.kinds:
                figures = measure(kind, hosts)
                print(kind, hosts, figures, file=sys.stderr, flush=True)
                found.setdefault((kind, hosts), []).append(figures)
    measuring.write("fleet", page(found, arguments.repeats))


if __name__ == "__main__":
    main()
