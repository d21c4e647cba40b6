"""Calls over a worker link against calls over zmq.asyncio: `python -m benchmarks.link`.

All in one run, repeat by repeat in turn: a 200-byte request and a 100-byte reply, packed with
msgpack at both ends, ids matched to callers, between two processes. A third way is the least that
asyncio can do: a socket pair, nothing checked and nothing cancelled. Writes
docs/benchmarks/link.md.
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
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import msgpack
import zmq
import zmq.asyncio
from benchmarks import measuring, zmq_calls
from benchmarks.measuring import IN_FLIGHT, REPLY, REQUEST, CallFigures, LoopCalling

from nondum.sdk.link import Link

OURS, ZMQ, BARE = "nondum link", "zmq.asyncio, ipc", "asyncio, a bare socket pair"
MAX_BYTES = 1024

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


async def serve_bare(descriptor: int) -> None:
    over = asyncio.Event()
    sock = socket.socket(fileno=descriptor)
    sock.settimeout(0)

    def take() -> None:
        data = sock.recv(MAX_BYTES)
        if not data:
            over.set()
            return
        call_id, _verb, _body = msgpack.unpackb(data)
        sock.send(msgpack.packb([call_id, REPLY]))

    asyncio.get_running_loop().add_reader(sock.fileno(), take)
    await over.wait()


async def serve_zmq(address: str) -> None:
    router = zmq.asyncio.Context.instance().socket(zmq.ROUTER)
    router.bind(address)
    await zmq_calls.answer(router, REPLY)


@contextlib.contextmanager
def server(kind: str, where: str, *, descriptors: tuple[int, ...] = ()) -> Any:
    command = [sys.executable, "-m", "benchmarks.link", "--serve", kind, where]
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
async def over_bare() -> AsyncIterator[tuple[Call, int]]:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.settimeout(0)
    loop, ids = asyncio.get_running_loop(), itertools.count(1)
    waiting = dict[int, asyncio.Future[Any]]()

    def take() -> None:
        call_id, body = msgpack.unpackb(ours.recv(MAX_BYTES))
        waiting.pop(call_id).set_result(body)

    def call() -> Awaitable[Any]:
        call_id = next(ids)
        reply = waiting[call_id] = loop.create_future()
        ours.send(msgpack.packb([call_id, "call", REQUEST]))
        return reply

    with server("bare", str(theirs.fileno()), descriptors=(theirs.fileno(),)) as pid:
        theirs.close()
        loop.add_reader(ours.fileno(), take)
        yield call, pid
        loop.remove_reader(ours.fileno())
        ours.close()


@contextlib.asynccontextmanager
async def over_zmq() -> AsyncIterator[tuple[Call, int]]:
    with tempfile.TemporaryDirectory() as folder:
        address = f"ipc://{Path(folder) / 'calls'}"
        with server("zmq", address) as pid:
            dealer = zmq.asyncio.Context.instance().socket(zmq.DEALER)
            dealer.connect(address)
            async with zmq_calls.asking(dealer, REQUEST) as call:
                yield call, pid
            dealer.close(linger=0)


async def compare(repeats: int, calls: int) -> dict[str, list[CallFigures]]:
    ways = {OURS: over_link, ZMQ: over_zmq, BARE: over_bare}
    found: dict[str, list[CallFigures]] = {way: [] for way in ways}
    for _ in range(repeats):
        for way, connect in ways.items():
            async with connect() as (call, pid):
                found[way].append(await measuring.measure_calls(LoopCalling(call), pid, calls))
    return found


def page(found: dict[str, list[CallFigures]], repeats: int, calls: int) -> str:
    ratios = {"link ÷ zmq": (OURS, ZMQ), "bare ÷ zmq": (BARE, ZMQ)}
    calls_table = measuring.call_table(found, ratios)
    return f"""# Calls: worker link against zmq.asyncio

`python -m benchmarks.link` wrote this page. A 200-byte request and a 100-byte reply between two
processes, msgpack at both ends; the link also checks every packet against its limits and runs each
request as a task that can be cancelled. The bare socket pair does neither: it is the least that two
asyncio loops take to wake each other. {repeats} repeats in turn of {calls:,} calls one by one and
{4 * calls:,} with 64 in flight; medians of the repeats (lowest-highest). CPU counts both processes.

{calls_table}

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
        case ["bare", descriptor]:
            asyncio.run(serve_bare(int(descriptor)))
        case ["zmq", address]:
            asyncio.run(serve_zmq(address))
        case _:
            found = asyncio.run(compare(arguments.repeats, arguments.calls))
            measuring.write("link", page(found, arguments.repeats, arguments.calls))


if __name__ == "__main__":
    main()
