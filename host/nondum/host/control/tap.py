"""Listening in on a stream from outside the daemon.

The daemon makes a connection, gives one end to the producing worker, like any consumer's, and the
other to the client along with its answer. The daemon stays out of the data path, and no path is
needed: client and daemon may see different file systems, as with a service's `PrivateTmp`.
"""

from __future__ import annotations

import asyncio
import functools
from collections.abc import AsyncIterator

from nondum.host.control.client import ControlClient
from nondum.sdk.errors import NondumError
from nondum.sdk.messages import Message
from nondum.sdk.packets import SocketPackets
from nondum.sdk.streams import Consumer
from nondum.sdk.wire import MAX_PACKET


async def messages(client: ControlClient, stream: str) -> AsyncIterator[Message]:
    """Messages of a stream, see `numbered`."""
    async for _, message in numbered(client, stream):
        yield message


async def numbered(client: ControlClient, stream: str) -> AsyncIterator[tuple[int, Message]]:
    """Messages of a stream from now on, newest wins, until its producer is gone; each with its
    number, as its producer counts what it sends, from 1.

    Raises `NondumError` when the host knows no such stream, or the producer breaks the protocol.
    """
    asking = functools.partial(client.ask_for_connection, "tap", stream=stream)
    told, connection = await asyncio.to_thread(asking)
    news: asyncio.Queue[NondumError | str] = asyncio.Queue()
    consumer = Consumer(
        told["type"],
        SocketPackets(connection, MAX_PACKET),
        lambda: news.put_nowait("message"),
        lambda violation: news.put_nowait(violation or "end"),
    )
    try:
        while (item := await news.get()) != "end":
            if isinstance(item, NondumError):
                raise item
            if (message := consumer.take()) is not None:
                yield consumer.number, message
    finally:
        consumer.close()
