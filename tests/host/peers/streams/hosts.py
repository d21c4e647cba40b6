"""Two hosts' bridges for the tests: real processes, real producers and consumers of streams."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable

import numpy as np

from nondum.host.forking.fork_client import ForkClient
from nondum.host.jobs.children import Children
from nondum.host.peers.streams.bridge import Bridge, Grant
from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.messages import Header, Image, Message
from nondum.sdk.packets import SocketPackets
from nondum.sdk.streams import Consumer, Producer
from nondum.sdk.wire import MAX_PACKET
from nondum.transport import link_sockets

PATIENCE_S = 60.0
HERE = ("tcp://127.0.0.1:0",)
SHAPE = (240, 320, 3)
NOISE = np.random.default_rng(7).integers(0, 256, SHAPE, np.uint8)


class Reader:
    """A consumer that keeps what it was handed, newest wins."""

    def __init__(self, kind: str) -> None:
        self.messages: list[Message] = []
        self.ended = asyncio.Event()
        self.violation: ProtocolViolation | None = None
        self._kind = kind
        self._news = asyncio.Event()
        self._consumer: Consumer | None = None

    async def attach(self, bridge: Bridge, number: int, name: str) -> None:
        """Become one more reader of an import."""
        ours, theirs = link_sockets()
        with theirs:
            await bridge.feed(number, name, theirs)
        packets = SocketPackets(ours, MAX_PACKET)
        self._consumer = Consumer(self._kind, packets, self._on_message, self._on_closed)

    async def until(self, holds: Callable[[Message], bool] = lambda _: True) -> Message:
        """Wait for a message, from the next one on."""
        async with asyncio.timeout(PATIENCE_S):
            seen = len(self.messages)
            while True:
                while seen < len(self.messages):
                    seen += 1
                    if holds(self.messages[seen - 1]):
                        return self.messages[seen - 1]
                self._news.clear()
                await self._news.wait()

    def close(self) -> None:
        if self._consumer is not None:
            self._consumer.close()

    def _on_message(self) -> None:
        assert self._consumer is not None
        message = self._consumer.take()
        if message is not None:
            self.messages.append(message)
            self._news.set()

    def _on_closed(self, violation: ProtocolViolation | None) -> None:
        self.violation = violation
        self.ended.set()


class Over:
    """Keeps why something is over."""

    def __init__(self) -> None:
        self._why: asyncio.Future[Problem] = asyncio.get_running_loop().create_future()

    def __call__(self, problem: Problem) -> None:
        self._why.set_result(problem)

    async def code(self) -> str:
        async with asyncio.timeout(PATIENCE_S):
            return (await asyncio.shield(self._why)).code


class Pair:
    """The bridge of a host that has a stream, and that of one that reads it."""

    def __init__(self, owner: Bridge, reader: Bridge, client: ForkClient) -> None:
        self.owner, self.reader, self.forks = owner, reader, client
        """The fork server is the reader's."""
        self._producers: list[Producer] = []
        self._readers: list[Reader] = []

    async def export(self, kind: str, reader: Bridge | None = None) -> tuple[Producer, Grant, Over]:
        """A stream, granted to a bridge."""
        producer, over = Producer(kind), Over()
        self._producers.append(producer)
        ours, theirs = link_sockets()
        async with self.owner.kept(), (reader or self.reader).kept() as key:
            with theirs:
                grant = await self.owner.export(kind, theirs, key, over)
        producer.connect("bridge", SocketPackets(ours, MAX_PACKET))
        return producer, grant, over

    async def reading(self, number: int, kind: str, name: str = "eye") -> Reader:
        """One more reader of an import."""
        reader = Reader(kind)
        self._readers.append(reader)
        await reader.attach(self.reader, number, name)
        return reader

    def close(self) -> None:
        for producer in self._producers:
            producer.close()
        for reader in self._readers:
            reader.close()


@contextlib.asynccontextmanager
async def forks() -> AsyncIterator[ForkClient]:
    """A host's fork server, ended after the block with all that it forked."""
    children = Children()
    try:
        yield children.forks
    finally:
        await children.close()


@contextlib.asynccontextmanager
async def bridge_of(
    client: ForkClient,
    listen: tuple[str, ...] = HERE,
    *,
    port: int = 0,
    idle_s: float = 10.0,
) -> AsyncIterator[Bridge]:
    """A bridge, ended after the block."""
    bridge = Bridge(client, listen, port=port, idle_s=idle_s)
    try:
        yield bridge
    finally:
        await bridge.close()


@contextlib.asynccontextmanager
async def pair(*, idle_s: float = 10.0) -> AsyncIterator[Pair]:
    """Two bridges, ended after the block."""
    async with (
        forks() as owners,
        forks() as readers,
        bridge_of(owners, idle_s=idle_s) as owner,
        bridge_of(readers, idle_s=idle_s) as reader,
    ):
        made = Pair(owner, reader, readers)
        try:
            yield made
        finally:
            made.close()


def header(seq: int) -> Header:
    """Of a message of a camera on the rover."""
    return Header(stamp_s=12.5 + seq / 3, frame_id="rover__cam__camera", seq=seq)


def noise(seq: int) -> Image:
    """An image that does not get smaller by coding it."""
    return Image.from_array(header(seq), NOISE, "bgr8")


@contextlib.asynccontextmanager
async def sent(
    producer: Producer, make: Callable[[int], Message] = noise, rate_hz: float = 100.0
) -> AsyncIterator[None]:
    """Messages, for as long as the block lasts."""
    task = asyncio.create_task(_send(producer, make, rate_hz))
    try:
        yield
    finally:
        task.cancel()


async def _send(producer: Producer, make: Callable[[int], Message], rate_hz: float) -> None:
    loop = asyncio.get_running_loop()
    begun_s, seq = loop.time(), 0
    while True:
        seq += 1
        producer.send(make(seq))
        await asyncio.sleep(max(0.0, begun_s + seq / rate_hz - loop.time()))
