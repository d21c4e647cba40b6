"""A relay between a host and a bad one that holds the end of a message back."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator


@contextlib.asynccontextmanager
async def held_back(address: str, *, to_it: int, from_it: int) -> AsyncIterator[str]:
    """An address to connect to in place of `address`.

    `to_it` and `from_it` bytes pass; after that nothing does, and the connections stay.
    """
    where, _, port = address.removeprefix("tcp://").rpartition(":")
    tasks: set[asyncio.Task[None]] = set()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there, to_there = await asyncio.open_connection(where, int(port))
        for source, sink, most in ((reader, to_there, to_it), (there, writer, from_it)):
            tasks.add(asyncio.create_task(_pass_on(source, sink, most)))

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    try:
        yield f"tcp://127.0.0.1:{server.sockets[0].getsockname()[1]}"
    finally:
        server.close()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _pass_on(source: asyncio.StreamReader, sink: asyncio.StreamWriter, most: int) -> None:
    with contextlib.suppress(ConnectionError), contextlib.closing(sink):
        while most and (data := await source.read(min(most, 1 << 16))):
            most -= len(data)
            sink.write(data)
            await sink.drain()
        while not most:  # nothing more passes; the connection stays until the host cuts it
            await asyncio.Event().wait()
