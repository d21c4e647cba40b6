"""Which stream is wired to which input, and why: the host introduces, workers do the rest.

An action's stream parameters are wired for as long as the action runs; the plan chose them.
Optional inputs are in no plan: `optional_inputs` says what each gets; they are wired again
whenever that changes. `Remote` wires a stream of another host, and only where a plan asks for it.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping
from contextlib import asynccontextmanager
from socket import socket as Connection
from typing import Protocol

from nondum.host.workers.optional_inputs import (
    Choice,
    Socket,
    Source,
    choose,
    sockets_of,
    sources_of,
)
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import NondumError, Problem, WorkerFailed
from nondum.sdk.frozen import frozen
from nondum.sdk.messages import MESSAGES
from nondum.sdk.signature import parse_signature
from nondum.transport import StreamBroker, Wire, WorkerLink

log = logging.getLogger(__name__)


@frozen
class StreamStatus:
    """A stream as people see it."""

    stream: str
    type: str
    component: str
    """One of a peer is `component@host`."""
    is_flowing: bool
    readers: tuple[str, ...]
    """Components, or `component.unit.slot` for optional inputs."""


class Remote(Protocol):
    """Reaches the streams of other hosts."""

    def owner(self, stream: str) -> str | None:
        """The component of a peer that has a stream, as it is known here; None if none has."""

    def is_open(self, stream: str) -> bool:
        """Whether a stream is being received."""

    async def connect(
        self, stream: str, kind: str, reader: str, consume: Callable[[Connection], Awaitable[None]]
    ) -> None:
        """Have a reader wired until `disconnect`; wait for the first time. Raises `NondumError`.

        `consume` gives a consumer's half of a connection to the reader, again after the stream had
        to be opened again.
        """

    async def tap(self, stream: str, name: str, connection: Connection) -> None:
        """Give an open stream one more consumer, as long as it is open. Raises `NondumError`."""

    def disconnect(self, stream: str, reader: str) -> None:
        """Feed a reader no more; unknown ones are ignored."""


@frozen
class _Member:
    """A component whose worker runs."""

    link: WorkerLink
    description: PluginDescription
    sources: tuple[Source, ...]
    sockets: tuple[Socket, ...]


class Streams:
    """All streams of a host and their wires. Its methods run on the loop."""

    def __init__(self, host: str, on_ambiguous: Callable[[Choice], None] = lambda _: None) -> None:
        """`on_ambiguous` is told of an optional input that several streams begin to fit."""
        self._host, self._on_ambiguous = host, on_ambiguous
        self._broker = StreamBroker()
        self._members: dict[str, _Member] = {}
        self._flowing: set[str] = set()
        self._required: Counter[Wire] = Counter()
        self._wires: dict[Wire, asyncio.Task[None]] = {}
        self._disconnecting: set[asyncio.Task[None]] = set()
        self._connected: Mapping[str, str] = {}
        self._choices: tuple[Choice, ...] = ()
        self._taps = itertools.count(1)
        self._remote: Remote | None = None

    def reach(self, remote: Remote) -> None:
        """From now on, plans may wire streams of other hosts."""
        self._remote = remote

    def join(self, component: str, link: WorkerLink, description: PluginDescription) -> None:
        """A component's worker runs: its outputs and inputs are there."""
        sources = tuple(sources_of(self._host, component, description))
        sockets = tuple(sockets_of(component, description))
        self._members[component] = _Member(link, description, sources, sockets)
        self._settle()

    def leave(self, component: str) -> None:
        """A component's worker is gone, and all its streams with it."""
        member = self._members.pop(component, None)
        if member is not None:
            self._flowing -= {source.stream for source in member.sources}
            self._settle()

    def set_flowing(self, stream: str, *, is_flowing: bool) -> None:
        """Messages have begun, or have stopped, to arrive."""
        if is_flowing:
            self._flowing.add(stream)
        else:
            self._flowing.discard(stream)
        self._settle()

    def connect(self, connected: Mapping[str, str]) -> None:
        """Go by what people have said from now on: name of an optional input → stream."""
        if connected != self._connected:
            self._connected = dict(connected)
            self._settle()

    @asynccontextmanager
    async def wired(
        self, component: str, behaviour: str, arguments: Mapping[str, str]
    ) -> AsyncIterator[None]:
        """Wire what a behaviour reads, for as long as the context lasts.

        Raises `WorkerFailed` (STREAM_UNKNOWN, or why an end refused), `LinkClosed`.
        """
        wires = tuple(self._wires_of(component, behaviour, arguments))
        self._required.update(wires)
        self._settle()
        try:
            for connecting in [self._wires[wire] for wire in wires]:
                await asyncio.shield(connecting)
            yield
        finally:
            self._required -= Counter(wires)
            self._settle()

    def listing(self) -> tuple[StreamStatus, ...]:
        """Every stream of every running component, by name, then those of peers that are read."""
        remote = {w.stream: Source(w.stream, w.type, w.producer) for w in self._remote_wires()}
        return tuple(
            StreamStatus(
                source.stream,
                source.type,
                source.component,
                source.stream in self._flowing or self._is_open(source.stream),
                tuple(sorted(w.reader for w in self._wires if w.stream == source.stream)),
            )
            for source in (*self._sources(), *sorted(remote.values()))
        )

    def inputs(self) -> tuple[Choice, ...]:
        """Every optional input of every running component, by name, and what feeds it."""
        return self._choices

    def sources(self) -> tuple[Source, ...]:
        """Every stream that a running component can produce, by name."""
        return tuple(self._sources())

    def senders(self) -> dict[int, str]:
        """Inode of each socket that a worker was given for a stream → who sends to it."""
        return self._broker.senders

    def ends(self) -> Counter[str]:
        """Component → how many ends of streams it has."""
        return Counter(name for wire in self._wires for name in (wire.producer, wire.consumer))

    def kind(self, stream: str) -> str:
        """The type of a running component's stream. Raises `WorkerFailed` (STREAM_UNKNOWN)."""
        return self._source(stream).type

    async def tap(self, stream: str, connection: Connection) -> None:
        """Give a stream's producer one more consumer, from outside the host.

        `connection` stays the caller's to close. Raises `WorkerFailed` (STREAM_UNKNOWN, or why the
        producer refused), `LinkClosed`.
        """
        name = f"tap-{next(self._taps)}"
        if self._remote is not None and self._remote.is_open(stream):
            await self._remote.tap(stream, name, connection)
            return
        source = self._source(stream)
        body = {"stream": stream, "type": source.type, "consumer": name}
        await self._members[source.component].link.request("produce", body, (connection.fileno(),))

    async def close(self) -> None:
        """Let go of everything; the workers' ends close with the workers."""
        tasks = (*self._wires.values(), *self._disconnecting)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _sources(self) -> list[Source]:
        return sorted(source for member in self._members.values() for source in member.sources)

    def _source(self, stream: str) -> Source:
        for source in self._sources():
            if source.stream == stream:
                return source
        raise WorkerFailed(_unknown(stream, "tap"))

    def _remote_wires(self) -> Iterator[Wire]:
        return (wire for wire in self._wires if _is_remote(wire))

    def _is_open(self, stream: str) -> bool:
        return self._remote is not None and self._remote.is_open(stream)

    def _wires_of(
        self, component: str, behaviour: str, arguments: Mapping[str, str]
    ) -> Iterator[Wire]:
        member = self._members.get(component)
        if member is None:
            raise WorkerFailed(Problem("NOT_RUNNING", "its worker has just ended", where=component))
        sources = {source.stream: source for source in self._sources()}
        types = _parameter_types(member.description, behaviour)
        for parameter, argument in arguments.items():
            source = sources.get(argument)
            if source is None:
                if (kind := types.get(parameter, "")) in MESSAGES:
                    yield self._remote_wire(argument, kind, component)
            elif source.component != component:
                yield Wire(source.stream, source.type, source.component, component)

    def _remote_wire(self, stream: str, kind: str, component: str) -> Wire:
        owner = self._remote.owner(stream) if self._remote is not None else None
        if owner is None:
            raise WorkerFailed(_unknown(stream, component))
        return Wire(stream, kind, owner, component)

    def _settle(self) -> None:
        """Bring the wires up to date with who is there, what flows and what is required."""
        sources = self._sources()
        flowing = [source for source in sources if source.stream in self._flowing]
        sockets = [socket for member in self._members.values() for socket in member.sockets]
        present = self._members.keys()
        wanted = {
            wire
            for wire in self._required
            if wire.consumer in present and (wire.producer in present or _is_remote(wire))
        }
        self._choose(choose(sockets, flowing, self._connected))
        wanted.update(choice.wire for choice in self._choices if choice.wire is not None)
        for wire in sorted(self._wires.keys() - wanted):
            self._disconnect(wire)
        for wire in sorted(wanted - self._wires.keys()):
            self._connect(wire)

    def _choose(self, choices: tuple[Choice, ...]) -> None:
        """Take over choices, and tell of those that were not ambiguous in this way before."""
        before = {(c.socket, c.source, c.others) for c in self._choices}
        self._choices = choices
        for choice in choices:
            if choice.is_ambiguous and (choice.socket, choice.source, choice.others) not in before:
                self._on_ambiguous(choice)

    def _connect(self, wire: Wire) -> None:
        consumer = self._members[wire.consumer].link
        if self._remote is not None and _is_remote(wire):
            introducing = self._remote.connect(
                wire.stream, wire.type, wire.reader, self._broker.half(wire, consumer)
            )
        else:
            producer = self._members[wire.producer].link
            introducing = self._broker.connect(wire, producer, consumer)
        connecting = asyncio.create_task(introducing)
        self._wires[wire] = connecting
        connecting.add_done_callback(lambda done: self._on_connected(wire, done))

    def _on_connected(self, wire: Wire, connecting: asyncio.Task[None]) -> None:
        if connecting.cancelled() or (error := connecting.exception()) is None:
            return
        if self._wires.get(wire) is connecting:
            del self._wires[wire]
        is_loud = not isinstance(error, NondumError) or error.code != "LINK_CLOSED"
        if is_loud:
            log.warning("%s cannot be wired to %s: %s", wire.stream, wire.reader, error)

    def _disconnect(self, wire: Wire) -> None:
        connecting = self._wires.pop(wire)
        if self._remote is not None and _is_remote(wire):
            connecting.cancel()
            self._remote.disconnect(wire.stream, wire.reader)
        links = (self._members.get(name) for name in (wire.producer, wire.consumer))
        producer, consumer = (member.link if member else None for member in links)
        # Whatever is still being connected was asked first, so it is also undone by this.
        task = asyncio.create_task(self._broker.disconnect(wire, producer, consumer))
        self._disconnecting.add(task)
        task.add_done_callback(self._disconnecting.discard)


def _parameter_types(description: PluginDescription, behaviour: str) -> dict[str, str]:
    """Type of each parameter of a behaviour's action; of alternatives, the first."""
    for described in description.behaviours:
        if described.name == behaviour:
            parameters = parse_signature(described.action).parameters
            return {parameter.name: parameter.types[0] for parameter in parameters}
    return {}


def _is_remote(wire: Wire) -> bool:
    """Component ids have no `@`: those of peers do."""
    return "@" in wire.producer


def _unknown(stream: str, component: str) -> Problem:
    message = f"no running component of this host has the stream {stream!r}"
    return Problem("STREAM_UNKNOWN", message, where=component)
