"""Both ends of streams between hosts, in one process: over real sockets, without a daemon."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
from collections.abc import AsyncIterator, Callable, Sequence
from typing import TypeVar

import zmq

from nondum.sdk.errors import Problem
from nondum.transport.peers.drained import Drained
from nondum.transport.peers.keys import HostKeys
from nondum.transport.streams import Coding, Exporter, Frame, Incoming, Outgoing, Place, packets
from nondum.transport.streams.sockets import dialling

PATIENCE_S = 60.0
T = TypeVar("T")


async def within(wanted: asyncio.Future[T]) -> T:
    async with asyncio.timeout(PATIENCE_S):
        return await asyncio.shield(wanted)


class Granted:
    """One granted stream at its owner's."""

    def __init__(self, exporter: Exporter, reader: HostKeys, kind: str = "image") -> None:
        loop = asyncio.get_running_loop()
        self.claimed: asyncio.Future[None] = loop.create_future()
        self.sends_at_once = 0
        """As many frames leave before anything that the reader says after its claim is read."""
        self.over: asyncio.Future[Problem] = loop.create_future()
        self.outgoing: Outgoing = exporter.grant(
            secrets.token_hex(16), reader.public, kind, self._on_can_send, self.over.set_result
        )

    def _on_can_send(self) -> None:
        if not self.claimed.done():
            self.claimed.set_result(None)
            for _ in range(self.sends_at_once):
                self.send()

    def send(self, bulk: bytes = b"pixels") -> None:
        self.outgoing.send(Coding.RAW, {"number": self.outgoing.frames_sent + 1}, bulk)


class Reading:
    """One stream at its reader's."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], keys: HostKeys, place: Place):
        loop = asyncio.get_running_loop()
        self.frames: list[Frame] = []
        self.untimed: list[Frame] = []
        """Frames with time stamps that cannot be converted to this host's clock."""
        self.opened: asyncio.Future[str] = loop.create_future()
        self.over: asyncio.Future[Problem] = loop.create_future()
        self.handles = True
        self._news = asyncio.Event()
        self.incoming = Incoming(
            context,
            keys,
            place,
            on_opened=self.opened.set_result,
            on_frame=self._on_frame,
            on_over=self.over.set_result,
        )

    async def until(self, count: int) -> Frame:
        """Wait for `count` frames; the last of them."""
        async with asyncio.timeout(PATIENCE_S):
            while len(self.frames) < count:
                self._news.clear()
                await self._news.wait()
        return self.frames[count - 1]

    def _on_frame(self, frame: Frame) -> None:
        self.frames.append(frame)
        if not self.incoming.clocks.are_known:
            self.untimed.append(frame)
        self._news.set()
        if self.handles:
            self.incoming.handled(frame.seq)


class Raw:
    """A stranger's socket, or a peer's that does what it likes."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], keys: HostKeys, place: Place):
        self.said: asyncio.Queue[packets.Told] = asyncio.Queue()
        socket = dialling(context, keys, place.owner)
        socket.connect(place.addresses[0])
        self.socket = Drained(socket, self._on_frames)

    def say(self, *parts: bytes) -> None:
        self.socket.send(parts)

    async def hears(self) -> packets.Told:
        async with asyncio.timeout(PATIENCE_S):
            return await self.said.get()

    def _on_frames(self, frames: list[zmq.Frame]) -> None:
        self.said.put_nowait(packets.read_told([frame.bytes for frame in frames]))


class LyingOwner:
    """A bridge that answers the first claim with whatever it is given, and says no more."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], *answers: Sequence[bytes]) -> None:
        self.keys = HostKeys.generate()
        self._answers = answers
        socket = context.socket(zmq.ROUTER)
        socket.linger = 0
        socket.curve_server = True
        socket.curve_secretkey = self.keys.secret.encode("ascii")
        self.port = socket.bind_to_random_port("tcp://127.0.0.1")
        self.socket = Drained(socket, self._on_frames)

    @property
    def place(self) -> Place:
        return Place((f"tcp://127.0.0.1:{self.port}",), self.keys.public, "token")

    def close(self) -> None:
        """Let go of it, as an exporter does: libzmq 4.3.5 aborts where a socket is closed without
        linger in the midst of a message of several parts, just as the other end leaves
        (session_base.cpp:233, libzmq issue 3442)."""
        self.socket.close(linger_ms=1000)

    def _on_frames(self, frames: list[zmq.Frame]) -> None:
        answers, self._answers = self._answers, ()
        for parts in answers:
            self.socket.send([frames[0].bytes, *parts])


@contextlib.asynccontextmanager
async def stalling(port: int, *, to_port: int, to_client: int) -> AsyncIterator[int]:
    """The port of a relay to a port of this machine.

    It passes `to_port` and `to_client` bytes, and holds the rest back.
    """

    async def carry(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, most: int) -> None:
        while most > 0 and (data := await reader.read(min(most, 65536))):
            most -= len(data)
            writer.write(data)
        if most > 0:
            writer.close()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        beyond, to_beyond = await asyncio.open_connection("127.0.0.1", port)
        ends.extend((writer, to_beyond))
        carried.add(asyncio.create_task(carry(reader, to_beyond, to_port)))
        carried.add(asyncio.create_task(carry(beyond, writer, to_client)))

    ends: list[asyncio.StreamWriter] = []
    carried: set[asyncio.Task[None]] = set()
    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()
        for task in carried:
            task.cancel()
        await asyncio.gather(*carried, return_exceptions=True)
        for end in ends:
            end.close()


class Owner:
    """A host's end, and what reads of it."""

    def __init__(self, exporter: Exporter, keys: HostKeys, port: int) -> None:
        self.exporter, self.keys, self.port = exporter, keys, port
        self.context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._closing: list[Callable[[], None]] = []

    def grant(self, reader: HostKeys, kind: str = "image") -> Granted:
        return Granted(self.exporter, reader, kind)

    def place(self, granted: Granted | str, *, port: int = 0) -> Place:
        token = granted if isinstance(granted, str) else granted.outgoing.token
        return Place((f"tcp://127.0.0.1:{port or self.port}",), self.keys.public, token)

    def read(self, keys: HostKeys, granted: Granted | str, *, port: int = 0) -> Reading:
        reading = Reading(self.context, keys, self.place(granted, port=port))
        self._closing.append(reading.incoming.close)
        return reading

    def raw(self, keys: HostKeys, granted: Granted | str, *, port: int = 0) -> Raw:
        raw = Raw(self.context, keys, self.place(granted, port=port))
        self._closing.append(raw.socket.close)
        return raw

    async def close(self) -> None:
        for close in self._closing:
            close()
        await asyncio.to_thread(self.context.term)


@contextlib.asynccontextmanager
async def owner() -> AsyncIterator[Owner]:
    """A host that exports, until the end of the block."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    keys = HostKeys.generate()
    exporter = Exporter(context, keys)
    made = Owner(exporter, keys, await exporter.start(("127.0.0.1",)))
    try:
        yield made
    finally:
        await made.close()
        exporter.close()
        await asyncio.to_thread(context.term)
