"""Introduces the two ends of a stream to each other; the data never passes through the host."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from socket import socket as Connection
from typing import Any

from nondum.sdk.errors import NondumError
from nondum.transport.link.worker_link import WorkerLink, link_sockets


@dataclass(frozen=True, slots=True, order=True)
class Wire:
    """One stream's way from the component that produces it to one input of another."""

    stream: str
    """Object name."""
    type: str
    """Stream type."""
    producer: str
    """Component."""
    consumer: str
    """Component."""
    unit: str = ""
    """Local name of the unit whose optional input this is; empty for an action's stream."""
    slot: str = ""
    """Name of the optional input."""

    @property
    def reader(self) -> str:
        """What the producer knows the consumer by."""
        return f"{self.consumer}.{self.unit}.{self.slot}" if self.slot else self.consumer

    def _input(self) -> dict[str, Any]:
        place = {"slot": self.slot, "unit": self.unit} if self.slot else {}
        return {"stream": self.stream, "type": self.type, **place}


class StreamBroker:
    """Connects and disconnects the ends of streams, by the links of their workers."""

    def __init__(self) -> None:
        self._ends: dict[Wire, dict[int, str]] = {}

    @property
    def senders(self) -> dict[int, str]:
        """Inode of each socket that was given to a worker → the component that sends to it."""
        return {inode: name for ends in self._ends.values() for inode, name in ends.items()}

    async def connect(self, wire: Wire, producer: WorkerLink, consumer: WorkerLink) -> None:
        """Give each end one half of a new connection, and wait until both have taken it.

        Both are asked before the first wait, so that what is asked of the same workers later comes
        after. Raises `WorkerFailed` or `LinkClosed`; then neither end is left connected.
        """
        ours, theirs = link_sockets()
        with ours, theirs:
            self._ends[wire] = {
                os.fstat(ours.fileno()).st_ino: wire.consumer,
                os.fstat(theirs.fileno()).st_ino: wire.producer,
            }
            answers = await asyncio.gather(
                consumer.request("consume", wire._input(), (theirs.fileno(),)),
                producer.request(
                    "produce",
                    {"stream": wire.stream, "type": wire.type, "consumer": wire.reader},
                    (ours.fileno(),),
                ),
                return_exceptions=True,
            )
        errors = [answer for answer in answers if isinstance(answer, BaseException)]
        if errors:
            await self.disconnect(wire, producer, consumer)
            raise errors[0]

    def half(self, wire: Wire, consumer: WorkerLink) -> Callable[[Connection], Awaitable[None]]:
        """A function that gives the consuming worker one half of a connection.

        Any process may have the other half.

        The half stays the caller's to close. Raises `WorkerFailed` or `LinkClosed`.
        """

        async def consume(connection: Connection) -> None:
            await consumer.request("consume", wire._input(), (connection.fileno(),))

        return consume

    async def disconnect(
        self, wire: Wire, producer: WorkerLink | None, consumer: WorkerLink | None
    ) -> None:
        """Take both ends back. An end that is gone, or None, has let go by itself."""
        self._ends.pop(wire, None)
        requests = []
        if consumer is not None:
            requests.append(consumer.request("unconsume", wire._input()))
        if producer is not None:
            body = {"stream": wire.stream, "consumer": wire.reader}
            requests.append(producer.request("unproduce", body))
        for answer in await asyncio.gather(*requests, return_exceptions=True):
            if isinstance(answer, BaseException) and not isinstance(answer, NondumError):
                raise answer
