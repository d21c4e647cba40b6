"""Calls over a worker link against calls over zmq.asyncio: `python benchmarks/link.py`.

Both in one run, repeat by repeat in turn: a 200-byte request and a 100-byte reply, packed with
msgpack at both ends, ids matched to callers, between two processes. Writes docs/benchmarks/link.md.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import itertools
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import measuring
import msgpack
import zmq
import zmq.asyncio
from measuring import Spread

from nondum.sdk.link import Link

REQUEST = {"data": "q" * 185}
REPLY = {"data": "a" * 85}
IN_FLIGHT = 64

Call = Callable[[], Awaitable[Any]]


async def refuse(*_request: Any) -> dict[str, Any]:
    raise RuntimeError("this end serves nothing")


async def answer(*_request: Any) -> dict[str, Any]:
    return REPLY


async def serve_link(descriptor: int) -> None:
    over = asyncio.Event()
    sock = socket.socket(fileno=descriptor)
    Link(sock, answer, lambda *event: None, over.set, lambda violation: None, credit=IN_FLIGHT)
    await over.wait()


async def serve_zmq(address: str) -> None:
    router = zmq.asyncio.Context.instance().socket(zmq.ROUTER)
    router.bind(address)
    while True:
        peer, data = await router.recv_multipart()
        call_id, verb, _body = msgpack.unpackb(data)
        if verb == "end":
            break
        await router.send_multipart([peer, msgpack.packb([call_id, REPLY])])
    router.close(linger=0)


@contextlib.contextmanager
def server(kind: str, where: str, *, descriptors: tuple[int, ...] = ()) -> Any:
    command = [sys.executable, __file__, "--serve", kind, where]
    with subprocess.Popen(command, pass_fds=descriptors) as process:
        try:
            yield process.pid
        finally:
            process.terminate()


@contextlib.asynccontextmanager
async def over_link() -> AsyncIterator[tuple[Call, int]]:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with server("link", str(theirs.fileno()), descriptors=(theirs.fileno(),)) as pid:
        theirs.close()
        link = Link(ours, refuse, lambda *event: None, lambda: None, lambda violation: None)
        yield lambda: link.request("call", REQUEST), pid
        link.close()


@contextlib.asynccontextmanager
async def over_zmq() -> AsyncIterator[tuple[Call, int]]:
    with tempfile.TemporaryDirectory() as folder:
        address = f"ipc://{Path(folder) / 'calls'}"
        with server("zmq", address) as pid:
            dealer = zmq.asyncio.Context.instance().socket(zmq.DEALER)
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


async def compare(repeats: int, calls: int) -> dict[str, list[Figures]]:
    ways = {"nondum link": over_link, "zmq.asyncio, ipc": over_zmq}
    found: dict[str, list[Figures]] = {way: [] for way in ways}
    for _ in range(repeats):
        for way, connect in ways.items():
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
    ours, theirs = spreads.values()
    rows = [
        [way, *(format(spread[f], style) for f, style in COLUMNS.values())]
        for way, spread in spreads.items()
    ]
    rows.append(["link ÷ zmq", *(measuring.ratio(ours[f], theirs[f]) for f, _ in COLUMNS.values())])
    return f"""# Calls: worker link against zmq.asyncio

`python benchmarks/link.py` wrote this page. A 200-byte request and a 100-byte reply between two
processes, msgpack at both ends; the link also checks every packet against its limits and runs each
request as a task that can be cancelled. {repeats} repeats in turn of {calls:,} calls one by one and
{4 * calls:,} with 64 in flight; medians of the repeats (lowest-highest). CPU counts both processes.

{measuring.table(["", *COLUMNS], rows)}

Machine: {measuring.machine()}; pyzmq {zmq.__version__}, libzmq {zmq.zmq_version()}.
p99 mostly shows what else the machine was doing; compare medians and ratios.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--calls", type=int, default=5000)
    parser.add_argument("--serve", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    match arguments.serve:
        case ["link", descriptor]:
            asyncio.run(serve_link(int(descriptor)))
        case ["zmq", address]:
            asyncio.run(serve_zmq(address))
        case _:
            found = asyncio.run(compare(arguments.repeats, arguments.calls))
            measuring.write("link", page(found, arguments.repeats, arguments.calls))


if __name__ == "__main__":
    main()
