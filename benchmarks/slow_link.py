"""A link between two hosts that carries only so much, or nothing for a while.

`python -m benchmarks.slow_link PORT BYTES_S` runs one in a separate process: it prints the port at
which it takes connections to `PORT`, and lasts until it is killed.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import sys
from collections.abc import AsyncIterator

CHUNK = 16 * 1024
BUFFER = 32 * 1024


class SlowLink:
    """Forwards TCP connections from its port to another one."""

    def __init__(self, port: int, bytes_s: float) -> None:
        self.bytes_s = bytes_s
        """From the owner to the reader; the other way is free."""
        self.forwarded = 0
        """Bytes from the owner to the reader so far."""
        self.port = 0
        self._target = port
        self._flows = asyncio.Event()
        self._flows.set()
        self._writers: list[asyncio.StreamWriter] = []

    def stall(self) -> None:
        """Carry nothing, in either direction; connections stay."""
        self._flows.clear()

    def resume(self) -> None:
        self._flows.set()

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with socket.socket() as sock:  # small buffers: what waits must wait at the owner's
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
            sock.settimeout(0)
            await asyncio.get_running_loop().sock_connect(sock, ("127.0.0.1", self._target))
            there, to_owner = await asyncio.open_connection(sock=sock.dup(), limit=BUFFER)
        self._writers += [writer, to_owner]
        with contextlib.suppress(ConnectionError):
            await asyncio.gather(self._frames(there, writer), self._answers(reader, to_owner))
        for one in (writer, to_owner):
            one.close()

    def close(self) -> None:
        self._flows.set()
        for writer in self._writers:
            writer.close()

    async def _frames(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        loop = asyncio.get_running_loop()
        ready_s = loop.time()
        while data := await reader.read(CHUNK):
            await self._flows.wait()
            ready_s = max(ready_s, loop.time() - 0.01) + len(data) / self.bytes_s
            if ready_s > loop.time():
                await asyncio.sleep(ready_s - loop.time())
            self.forwarded += len(data)
            writer.write(data)
            await writer.drain()
        writer.close()

    async def _answers(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(CHUNK):
            await self._flows.wait()
            writer.write(data)
            await writer.drain()
        writer.close()


@contextlib.asynccontextmanager
async def slow_link(port: int, bytes_s: float = float("inf")) -> AsyncIterator[SlowLink]:
    """A link to a port of this machine, until the end of the block."""
    link = SlowLink(port, bytes_s)
    server = await asyncio.start_server(link.serve, "127.0.0.1", 0)
    link.port = server.sockets[0].getsockname()[1]
    try:
        yield link
    finally:
        server.close()
        link.close()


async def _forever(port: int, bytes_s: float) -> None:
    async with slow_link(port, bytes_s) as link:
        print(link.port, flush=True)
        await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(_forever(int(sys.argv[1]), float(sys.argv[2])))
