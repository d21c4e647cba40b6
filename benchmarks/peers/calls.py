"""Calls between two processes over TCP on loopback, by the peer link and by what others use."""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import json
import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractAsyncContextManager
from importlib.util import find_spec
from typing import Any

import msgpack
import zmq
import zmq.asyncio
from benchmarks import zmq_calls
from benchmarks.measuring import (
    REQUEST,
    CallFigures,
    Calling,
    LoopCalling,
    ThreadCalling,
    measure_calls,
)
from benchmarks.peers.crew import ROOT
from benchmarks.peers.serving import SERVING_NAME, ZENOH_KEY, Keys, node, zenoh_session

from nondum.transport.peers import HostKeys, Identity, PeerKey, PeerUp
from nondum.transport.peers.events import PeerEvent

OURS = ("nondum peers, CURVE", "the same, each call a task", "the same, not encrypted")
Connected = AbstractAsyncContextManager[tuple[Calling, int]]
"""How to call, and the process that answers."""
Found = dict[str, list[CallFigures]]


@contextlib.contextmanager
def serving(kind: str, keys: Keys) -> Iterator[tuple[str, int]]:
    """A process that answers: its address and its id."""
    command = [sys.executable, "-m", "benchmarks.peers.serving", kind, json.dumps(keys)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield process.stdout.readline().strip(), process.pid
        finally:
            process.kill()


def fresh_keys(client: PeerKey) -> Keys:
    """Of a process that lets in one client."""
    pair = HostKeys.generate()
    return {"public": pair.public, "secret": pair.secret, "client": client}


def no_keys(client: PeerKey) -> Keys:
    """Of one in development mode."""
    return {"public": Identity(SERVING_NAME, None).key, "secret": "", "client": client}


@contextlib.asynccontextmanager
async def by_peers(
    method: str, pair: HostKeys | None, theirs: Callable[[PeerKey], Keys]
) -> AsyncIterator[tuple[Calling, int]]:
    mine = Identity("asking", pair)
    keys = theirs(mine.key)
    events: asyncio.Queue[PeerEvent] = asyncio.Queue()
    with serving("peers", keys) as (address, pid):
        there = PeerKey(keys["public"])
        here = node(mine, there, events.put_nowait)
        await here.start([])
        here.dial(there, [address])
        while not isinstance(await events.get(), PeerUp):
            pass
        try:
            yield LoopCalling(lambda: here.call(there, method, REQUEST, deadline_s=30)), pid
        finally:
            await here.close()


@contextlib.asynccontextmanager
async def by_zmq() -> AsyncIterator[tuple[Calling, int]]:
    mine = HostKeys.generate()
    keys = fresh_keys(mine.public)
    with serving("zmq", keys) as (address, pid):
        dealer = zmq.asyncio.Context.instance().socket(zmq.DEALER)
        dealer.curve_publickey, dealer.curve_secretkey = mine.public.encode(), mine.secret.encode()
        dealer.curve_serverkey = keys["public"].encode()
        dealer.connect(address)
        try:
            async with zmq_calls.asking(dealer, REQUEST) as call:
                yield LoopCalling(call), pid
        finally:
            dealer.close(linger=0)


@contextlib.asynccontextmanager
async def by_grpc() -> AsyncIterator[tuple[Calling, int]]:
    grpc: Any = importlib.import_module("grpc")
    with serving("grpc", {}) as (address, pid):
        async with grpc.aio.insecure_channel(address) as channel:
            ask = channel.unary_unary("/Bench/Call")

            async def call() -> Any:
                return msgpack.unpackb(await ask(msgpack.packb(REQUEST)))

            yield LoopCalling(call), pid


@contextlib.asynccontextmanager
async def by_zenoh(calling: Callable[[Any], Calling]) -> AsyncIterator[tuple[Calling, int]]:
    zenoh: Any = importlib.import_module("zenoh")
    with socket.create_server(("127.0.0.1", 0)) as free:
        listen = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    with (
        serving("zenoh", {"listen": listen}) as (address, pid),
        zenoh_session({"connect/endpoints": [address]}) as session,
    ):
        asking = session.declare_querier(ZENOH_KEY, consolidation=zenoh.ConsolidationMode.NONE)
        while not asking.matching_status:  # noqa: ASYNC110  # nothing on this loop knows
            await asyncio.sleep(0.01)
        yield calling(asking), pid


def zenoh_awaited(asking: Any) -> Calling:
    """Replies come on a thread of Zenoh's, and hop to the loop straight from there."""
    callback: Any = importlib.import_module("zenoh.handlers").Callback
    loop = asyncio.get_running_loop()

    async def call() -> Any:
        reply: asyncio.Future[bytes] = loop.create_future()

        def take(answer: Any) -> None:
            loop.call_soon_threadsafe(reply.set_result, answer.ok.payload.to_bytes())

        asking.get(callback(take, indirect=False), payload=msgpack.packb(REQUEST))
        return msgpack.unpackb(await reply)

    return LoopCalling(call)


def zenoh_blocking(asking: Any) -> Calling:
    """The thread that asks waits for its reply."""

    def call() -> Any:
        (reply,) = asking.get(payload=msgpack.packb(REQUEST))
        return msgpack.unpackb(reply.ok.payload.to_bytes())

    return ThreadCalling(call)


def ways() -> dict[str, Callable[[], Connected]]:
    """Those whose libraries are installed; ours first."""
    found: dict[str, Callable[[], Connected]] = {
        OURS[0]: lambda: by_peers("now", HostKeys.generate(), fresh_keys),
        OURS[1]: lambda: by_peers("later", HostKeys.generate(), fresh_keys),
        OURS[2]: lambda: by_peers("now", None, no_keys),
        "zmq.asyncio, CURVE": by_zmq,
    }
    if find_spec("grpc"):
        found["gRPC (asyncio), not encrypted"] = by_grpc
    if find_spec("zenoh"):
        found["Zenoh from asyncio, not encrypted"] = lambda: by_zenoh(zenoh_awaited)
        found["Zenoh from threads, not encrypted"] = lambda: by_zenoh(zenoh_blocking)
    return found


def missing() -> list[str]:
    """What cannot be measured here."""
    packages = {"grpc": "grpcio", "zenoh": "eclipse-zenoh"}
    return [package for module, package in packages.items() if not find_spec(module)]


async def measure(repeats: int, calls: int) -> Found:
    """All ways, repeat by repeat in turn."""
    found: Found = {way: [] for way in ways()}
    for _ in range(repeats):
        for way, connect in ways().items():
            async with connect() as (calling, pid):
                found[way].append(await measure_calls(calling, pid, calls))
            print(f"peers: {way}: {found[way][-1]}", file=sys.stderr)
    return found
