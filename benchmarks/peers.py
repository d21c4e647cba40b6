"""Calls between hosts against zmq.asyncio and gRPC: `python benchmarks/peers.py`.

All in one run, repeat by repeat in turn: a 200-byte request and a 100-byte reply between two
processes over TCP on loopback, encrypted by CURVE where that is said. gRPC is measured where
grpcio is installed. Writes docs/benchmarks/peers.md.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import itertools
import json
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import measuring
import msgpack
import zmq
import zmq.asyncio
from measuring import Spread

from nondum.transport.peers import Errand, HostKeys, Identity, Lease, PeerKey, PeerNode, Trust

REQUEST = {"data": "q" * 185}
REPLY = {"data": "a" * 85}
IN_FLIGHT = 64

Call = Callable[[], Awaitable[Any]]
Keys = dict[str, str]


class Answering:
    """Serves one thing; at once, or as a task that can be cancelled."""

    def serve(self, errand: Errand) -> Any:
        return REPLY if errand.method == "now" else self.later()

    async def later(self) -> dict[str, str]:
        return REPLY

    def notice(self, *_: Any) -> None: ...

    def orphaned(self, *_: Any) -> Lease:
        return Lease.STOP


def node(mine: HostKeys, theirs: str, on_event: Callable[[Any], None]) -> PeerNode:
    trust = Trust().with_paired(PeerKey(theirs), "other")
    return PeerNode(Identity("host", mine), trust, Answering(), on_event=on_event)


async def serve_peers(keys: Keys) -> None:
    pair = HostKeys(PeerKey(keys["public"]), keys["secret"])
    serving = node(pair, keys["client"], lambda event: None)
    print(*await serving.start(["tcp://127.0.0.1:0"]), flush=True)
    await asyncio.Event().wait()


async def serve_zmq(keys: Keys) -> None:
    router = zmq.asyncio.Context.instance().socket(zmq.ROUTER)
    router.curve_server, router.curve_secretkey = True, keys["secret"].encode()
    port = router.bind_to_random_port("tcp://127.0.0.1")
    print(f"tcp://127.0.0.1:{port}", flush=True)
    while True:
        peer, data = await router.recv_multipart()
        call_id, _verb, _body = msgpack.unpackb(data)
        await router.send_multipart([peer, msgpack.packb([call_id, REPLY])])


async def serve_grpc(_keys: Keys) -> None:
    import grpc

    async def answer(request: bytes, _context: object) -> bytes:
        msgpack.unpackb(request)
        return msgpack.packb(REPLY)

    server = grpc.aio.server()
    handler = grpc.unary_unary_rpc_method_handler(answer)
    generic = grpc.method_handlers_generic_handler("Bench", {"Call": handler})
    server.add_generic_rpc_handlers((generic,))
    print(f"127.0.0.1:{server.add_insecure_port('127.0.0.1:0')}", flush=True)
    await server.start()
    await server.wait_for_termination()


@contextlib.contextmanager
def server(kind: str, keys: Keys) -> Iterator[tuple[str, int]]:
    command = [sys.executable, __file__, "--serve", kind, json.dumps(keys)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield process.stdout.readline().strip(), process.pid
        finally:
            process.kill()


def fresh_keys(client: HostKeys) -> Keys:
    pair = HostKeys.generate()
    return {"public": pair.public, "secret": pair.secret, "client": client.public}


@contextlib.asynccontextmanager
async def over_peers(method: str) -> AsyncIterator[tuple[Call, int]]:
    mine = HostKeys.generate()
    keys = fresh_keys(mine)
    events: asyncio.Queue[Any] = asyncio.Queue()
    with server("peers", keys) as (address, pid):
        here, there = node(mine, keys["public"], events.put_nowait), PeerKey(keys["public"])
        await here.start([])
        here.dial(there, [address])
        await events.get()
        yield lambda: here.call(there, method, REQUEST, deadline_s=30), pid
        await here.close()


@contextlib.asynccontextmanager
async def over_zmq() -> AsyncIterator[tuple[Call, int]]:
    mine = HostKeys.generate()
    keys = fresh_keys(mine)
    with server("zmq", keys) as (address, pid):
        dealer = zmq.asyncio.Context.instance().socket(zmq.DEALER)
        dealer.curve_publickey, dealer.curve_secretkey = mine.public.encode(), mine.secret.encode()
        dealer.curve_serverkey = keys["public"].encode()
        dealer.connect(address)
        ids, waiting = itertools.count(1), dict[int, asyncio.Future[Any]]()

        async def receive() -> None:
            while True:
                call_id, body = msgpack.unpackb(await dealer.recv())
                waiting.pop(call_id).set_result(body)

        async def call() -> Any:
            call_id = next(ids)
            reply = waiting[call_id] = asyncio.get_running_loop().create_future()
            await dealer.send(msgpack.packb([call_id, "call", REQUEST]))
            return await reply

        receiving = asyncio.create_task(receive())
        yield call, pid
        receiving.cancel()
        dealer.close(linger=0)


@contextlib.asynccontextmanager
async def over_grpc() -> AsyncIterator[tuple[Call, int]]:
    import grpc

    with server("grpc", {}) as (address, pid):
        async with grpc.aio.insecure_channel(address) as channel:
            ask = channel.unary_unary("/Bench/Call")

            async def call() -> Any:
                return msgpack.unpackb(await ask(msgpack.packb(REQUEST)))

            yield call, pid


@dataclass(frozen=True, slots=True)
class Figures:
    """One repeat."""

    median_us: float
    p99_us: float
    cpu_us: float
    """Client and server together, per call."""
    burst_calls: float
    """Calls per second with 64 in flight."""
    burst_cpu_us: float


async def measure(call: Call, pid: int, calls: int) -> Figures:
    for _ in range(200):  # both processes warm
        await call()
    took, before = [], measuring.cpu_s() + measuring.cpu_s(pid)
    for _ in range(calls):
        begun = time.perf_counter()
        await call()
        took.append((time.perf_counter() - begun) * 1e6)
    between = measuring.cpu_s() + measuring.cpu_s(pid)
    begun, left = time.perf_counter(), iter(range(4 * calls))

    async def caller() -> None:
        for _ in left:
            await call()

    await asyncio.gather(*(caller() for _ in range(IN_FLIGHT)))
    burst_s = time.perf_counter() - begun
    after = measuring.cpu_s() + measuring.cpu_s(pid)
    return Figures(
        median_us=measuring.percentile(took, 50),
        p99_us=measuring.percentile(took, 99),
        cpu_us=(between - before) / calls * 1e6,
        burst_calls=4 * calls / burst_s,
        burst_cpu_us=(after - between) / (4 * calls) * 1e6,
    )


def ways() -> dict[str, Callable[[], Any]]:
    found: dict[str, Callable[[], Any]] = {
        "nondum peers, CURVE": lambda: over_peers("now"),
        "the same, each call a task": lambda: over_peers("later"),
        "zmq.asyncio, CURVE": over_zmq,
    }
    if find_spec("grpc"):
        found["gRPC, not encrypted"] = over_grpc
    return found


async def compare(repeats: int, calls: int) -> dict[str, list[Figures]]:
    found: dict[str, list[Figures]] = {way: [] for way in ways()}
    for _ in range(repeats):
        for way, connect in ways().items():
            async with connect() as (call, pid):
                found[way].append(await measure(call, pid, calls))
    return found


COLUMNS = {
    "one in flight: median µs": ("median_us", ".0f"),
    "p99 µs": ("p99_us", ".0f"),
    "CPU µs per call": ("cpu_us", ".0f"),
    "64 in flight: calls/s": ("burst_calls", ",.0f"),
    "CPU µs per call ": ("burst_cpu_us", ".0f"),
}


def page(found: dict[str, list[Figures]], repeats: int, calls: int) -> str:
    spreads = {
        way: {f: Spread(tuple(getattr(one, f) for one in figures)) for f, _ in COLUMNS.values()}
        for way, figures in found.items()
    }
    rows = [
        [way, *(format(spread[f], style) for f, style in COLUMNS.values())]
        for way, spread in spreads.items()
    ]
    ours, *others = spreads.items()
    rows += [
        [f"peers ÷ {way}", *(measuring.ratio(ours[1][f], other[f]) for f, _ in COLUMNS.values())]
        for way, other in others[1:]
    ]
    missing = "" if find_spec("grpc") else "\ngrpcio was not installed, so gRPC is not measured."
    return f"""# Calls between hosts: peer link against zmq.asyncio and gRPC

`python benchmarks/peers.py` wrote this page. A 200-byte request and a 100-byte reply between two
processes over TCP on loopback, msgpack at both ends. The peer link also checks every message
against its limits and its key, carries deadlines, and remembers answers so that no call runs twice;
zmq.asyncio and gRPC here do none of this. {repeats} repeats in turn of {calls:,} calls one by one
and {4 * calls:,} with 64 in flight; medians of the repeats (lowest-highest). CPU counts both
processes, with ZeroMQ's threads.{missing}

{measuring.table(["", *COLUMNS], rows)}

Machine: {measuring.machine()}; pyzmq {zmq.__version__}, libzmq {zmq.zmq_version()}.
p99 mostly shows what else the machine was doing; compare medians and ratios.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--calls", type=int, default=4000)
    parser.add_argument("--serve", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve is None:
        found = asyncio.run(compare(arguments.repeats, arguments.calls))
        measuring.write("peers", page(found, arguments.repeats, arguments.calls))
        return
    kind, keys = arguments.serve
    serve = {"peers": serve_peers, "zmq": serve_zmq, "grpc": serve_grpc}[kind]
    asyncio.run(serve(json.loads(keys)))


if __name__ == "__main__":
    main()
