"""Listening in on a stream from outside the daemon.

The client listens on a socket of its own and names it; the daemon connects to it and hands the
connection to the producing worker, like any consumer's. The daemon stays out of the data path.
"""

from __future__ import annotations

import asyncio
import socket
import tempfile
from collections.abc import AsyncIterator
from pathlib import Path

from nondum.host.control.client import ControlClient
from nondum.sdk.errors import NondumError
from nondum.sdk.messages import Message
from nondum.sdk.packets import SocketPackets
from nondum.sdk.streams import Consumer
from nondum.sdk.wire import MAX_PACKET


async def messages(client: ControlClient, stream: str) -> AsyncIterator[Message]:
    """Messages of a stream from now on, newest wins, until its producer is gone.

    Raises `NondumError` when the host knows no such stream, or the producer breaks the protocol.
    """
    kind, connection = await asyncio.to_thread(_connect, client, stream)
    news: asyncio.Queue[NondumError | str] = asyncio.Queue()
    consumer = Consumer(
        kind,
        SocketPackets(connection, MAX_PACKET),
        lambda: news.put_nowait("message"),
        lambda violation: news.put_nowait(violation or "end"),
    )
    try:
        while (item := await news.get()) != "end":
            if isinstance(item, NondumError):
                raise item
            if (message := consumer.take()) is not None:
                yield message
    finally:
        consumer.close()


def _connect(client: ControlClient, stream: str) -> tuple[str, socket.socket]:
    with (
        tempfile.TemporaryDirectory(prefix="nondum-tap-") as folder,
        socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener,
    ):
        address = Path(folder) / "tap"
        listener.bind(str(address))
        listener.listen(1)
        kind = client.ask("tap", stream=stream, address=str(address))["type"]
        connection, _ = listener.accept()
        return kind, connection
