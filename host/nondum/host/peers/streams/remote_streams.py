"""Streams of other hosts that are read here: each is opened once, however many read it.

A stream that ends while it is wanted (a bridge died, the network broke) is opened again, and its
readers are connected again, until no reader wants it any more.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from socket import socket as Connection
from typing import Any, TypeAlias

from nondum.host.peers.streams.bridge import Bridge, Grant
from nondum.sdk.errors import LinkClosed, NondumError, Problem, WorkerFailed
from nondum.sdk.wire import Body
from nondum.transport import link_sockets
from nondum.transport.peers.keys import parse_key

FIRST_WAIT_S = 0.2
LONGEST_WAIT_S = 5.0

Call: TypeAlias = Callable[[str, str, Body], Awaitable[Body]]
"""Calls a peer by its host's name: `(host, method, args)`; raises `NondumError`."""
Consume: TypeAlias = Callable[[Connection], Awaitable[None]]
"""Gives the consumer's half of a connection to a reader; raises `NondumError`."""

log = logging.getLogger(__name__)


@dataclass(slots=True)
class _Reader:
    consume: Consume
    fed: asyncio.Future[None]
    """Settled when it was wired for the first time, or cannot be."""


class _Import:
    """One stream of another host, wanted by some readers."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.readers: dict[str, _Reader] = {}
        self.number = 0
        """Of the bridge's import, while the stream is open."""
        self.task: asyncio.Task[None] | None = None


class RemoteStreams:
    """What this host reads of others. `await close()` it before its bridge."""

    def __init__(
        self,
        bridge: Bridge,
        call: Call,
        addresses: Callable[[str], Sequence[str]],
    ) -> None:
        """`addresses` gives where a peer is reached now, `tcp://HOST:PORT`, by its host's name;
        nothing for a host that is no peer."""
        self._bridge, self._call, self._addresses = bridge, call, addresses
        self._imports: dict[str, _Import] = {}
        self._closing: set[asyncio.Task[None]] = set()

    def owner(self, stream: str) -> str | None:
        """The component that has a stream, as it is known here; None if it is no peer's.

        Of `base__front-camera__image`, this is `front-camera@base` if `base` is a peer.
        """
        host, _, rest = stream.partition("__")
        component, _, slot = rest.partition("__")
        return f"{component}@{host}" if slot and self._addresses(host) else None

    @property
    def readers(self) -> Mapping[str, tuple[str, ...]]:
        """Who reads what, by stream."""
        return {stream: tuple(sorted(one.readers)) for stream, one in self._imports.items()}

    def is_open(self, stream: str) -> bool:
        """Whether a stream is being received."""
        return stream in self._imports and self._imports[stream].number > 0

    async def connect(self, stream: str, kind: str, reader: str, consume: Consume) -> None:
        """Have a reader wired to a stream of type `kind` until `disconnect`; wait for the first.

        Raises what the first attempt met: `WorkerFailed`, `LinkClosed`, `HostUnreachable` or
        whatever else the call to the peer did. Then the reader is not connected.
        """
        wanted = self._imports.get(stream)
        if wanted is None:
            wanted = self._imports[stream] = _Import(kind)
        elif wanted.kind != kind:
            raise WorkerFailed(_other_type(stream, wanted.kind, kind))
        added = _Reader(consume, asyncio.get_running_loop().create_future())
        wanted.readers[reader] = added
        if wanted.task is None:
            wanted.task = asyncio.create_task(self._keep(stream, wanted))
        elif wanted.number:
            await self._feed(wanted, reader)
        try:
            await added.fed
        except BaseException:
            if wanted.readers.get(reader) is added:
                self.disconnect(stream, reader)
            raise

    async def tap(self, stream: str, name: str, connection: Connection) -> None:
        """Give a stream that is read here one more consumer; `connection` stays the caller's.

        It ends with the stream: nothing is opened for it, or again. Raises `WorkerFailed`
        (STREAM_UNKNOWN), `LinkClosed`.
        """
        number = self._imports[stream].number if stream in self._imports else 0
        await self._bridge.feed(number, name, connection)

    def disconnect(self, stream: str, reader: str) -> None:
        """Feed a reader no more; with the last one, the stream is closed. Unknown ones are ignored.

        What the reader has of the connection is its own to close.
        """
        wanted = self._imports.get(stream)
        gone = wanted.readers.pop(reader, None) if wanted else None
        if wanted is None or gone is None:
            return
        if not gone.fed.done():
            gone.fed.cancel()
        if wanted.readers:
            self._aside(self._bridge.unfeed(wanted.number, reader))
            return
        del self._imports[stream]
        if wanted.task is not None:
            wanted.task.cancel()
            self._closing.add(wanted.task)
            wanted.task.add_done_callback(self._closing.discard)

    async def close(self) -> None:
        """Let go of everything."""
        for stream, wanted in list(self._imports.items()):
            for reader in list(wanted.readers):
                self.disconnect(stream, reader)
        while self._closing:
            await asyncio.wait(self._closing)

    async def _keep(self, stream: str, wanted: _Import) -> None:
        """Have a stream open as long as it is wanted."""
        loop, wait_s = asyncio.get_running_loop(), FIRST_WAIT_S
        while True:
            begun_s = loop.time()
            try:
                await self._read(stream, wanted)
            except NondumError as error:
                log.info("%s cannot be read: %s", stream, error)
                self._refuse(wanted, error)
            if loop.time() - begun_s > LONGEST_WAIT_S:  # it went well for long
                wait_s = FIRST_WAIT_S
            await asyncio.sleep(wait_s)
            wait_s = min(2 * wait_s, LONGEST_WAIT_S)

    async def _read(self, stream: str, wanted: _Import) -> None:
        """Open a stream, feed its readers, and wait until it ends. Raises `NondumError`."""
        host = stream.partition("__")[0]
        over: asyncio.Future[Problem] = asyncio.get_running_loop().create_future()
        number, token = 0, ""
        try:
            async with self._bridge.kept() as key:
                opened = await self._call(host, "stream.open", {"stream": stream, "bridge": key})
                grant = _grant(opened)
                token = grant.token
                if opened.get("type") != wanted.kind:
                    raise WorkerFailed(_other_type(stream, opened.get("type"), wanted.kind))
                number = wanted.number = await self._bridge.import_(
                    wanted.kind, self._addresses(host), grant, _settling(over)
                )
            await asyncio.gather(*(self._feed(wanted, reader) for reader in list(wanted.readers)))
            log.info("%s has ended: %s", stream, await over)
        finally:
            wanted.number = 0
            self._aside(self._part(number, host, token))

    async def _part(self, number: int, host: str, token: str) -> None:
        await self._bridge.unimport(number)
        if token:
            with contextlib.suppress(NondumError):  # a host that is gone has closed it
                await self._call(host, "stream.close", {"token": token})

    async def _feed(self, wanted: _Import, name: str) -> None:
        """Wire one reader; its failure is its own. A bridge that failed will feed it again."""
        reader = wanted.readers.get(name)
        if reader is None:
            return
        ours, theirs = link_sockets()
        with ours, theirs:
            consumed, fed = await asyncio.gather(
                reader.consume(theirs),
                self._bridge.feed(wanted.number, name, ours),
                return_exceptions=True,
            )
        if reader.fed.done():
            return
        if isinstance(consumed, BaseException):
            reader.fed.set_exception(consumed)
        elif fed is None:
            reader.fed.set_result(None)

    def _refuse(self, wanted: _Import, error: NondumError) -> None:
        for reader in list(wanted.readers.values()):
            if not reader.fed.done():
                reader.fed.set_exception(error)

    def _aside(self, work: Any) -> None:
        task = asyncio.get_running_loop().create_task(_quietly(work))
        self._closing.add(task)
        task.add_done_callback(self._closing.discard)


async def _quietly(work: Awaitable[Any]) -> None:
    with contextlib.suppress(WorkerFailed, LinkClosed):
        await work


def _other_type(stream: str, found: object, expected: str) -> Problem:
    return Problem("STREAM_TYPE", f"{stream} is of type {found}, not {expected}")


def _settling(over: asyncio.Future[Problem]) -> Callable[[Problem], None]:
    def settle(problem: Problem) -> None:
        if not over.done():
            over.set_result(problem)

    return settle


def _grant(answer: Body) -> Grant:
    """Read what a peer answered. Raises `NondumError` (STREAM_ANSWER, KEY_MALFORMED)."""
    match answer:
        case {"port": int(port), "key": str(key), "token": str(token)} if 0 < port < 65536:
            return Grant(port, parse_key(key), token)
    raise WorkerFailed(Problem("STREAM_ANSWER", "the peer's answer grants no stream"))
