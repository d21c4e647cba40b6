"""The host's end of the socket at which the init of a worker's sandbox takes orders.

The init is process 1 of the sandbox and runs `nondum.host.sandbox.inside.init`; the worker can make
it slow, so nothing waits for it without a limit.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import socket
import struct
from typing import Any

from nondum.host.sandbox.inside.mounts import DEVICES
from nondum.host.workers import scratch
from nondum.sdk.errors import Problem, WorkerFailed
from nondum.sdk.frozen import frozen

ANSWER_S = 2.0
"""How long one order may take."""
MOST_SILENCES = 5
"""In a row, before what the worker holds open counts as too much."""
_ANSWER_BYTES = 4096
CREDENTIALS = struct.Struct("=iII")
"""`struct ucred` (unix(7)): process, user, group."""


@frozen
class OpenFiles:
    """What the processes of a sandbox have open."""

    descriptors: int
    """Of the one that has most."""
    deleted_bytes: int
    """In files of its disk that were deleted."""


class InitLink:
    """One worker's. Make it on the loop; `close` it once its process has ended."""

    def __init__(self, orders: socket.socket) -> None:
        """Takes over the socket."""
        self._orders = orders
        self._orders.settimeout(0)
        self._turn = asyncio.Lock()
        self._worker: int | None = None
        self._pidfd: int | None = None
        self._silences = 0
        self._answers: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        asyncio.get_running_loop().add_reader(orders.fileno(), self._read)

    @property
    def worker(self) -> int | None:
        """The worker's process, as this host counts; None before it has said so."""
        if self._worker is None and self._orders.fileno() >= 0:
            self._read()
        return self._worker

    async def grant(self, need: str, node: str, own: str) -> None:
        """Have a device appear in the sandbox, at `node_of`, and a link to it where it is outside.

        Raises `WorkerFailed` (DEVICE_REFUSED).
        """
        answer = await self._ask({"do": "grant", "need": need, "node": _real(node), "own": own})
        if answer["error"]:
            raise WorkerFailed(
                Problem(
                    "DEVICE_REFUSED",
                    f"the device cannot be handed in: {answer['error']}",
                    where=f"{need}: {node}",
                    fix="see that it is a device below /dev that the host's user may open",
                )
            )

    async def revoke(self, need: str) -> None:
        """Have it vanish."""
        await self._ask({"do": "revoke", "need": need})

    async def open_files(self) -> OpenFiles:
        """What the processes of the sandbox have open.

        A worker may keep its init from answering: again and again, that counts as too much.
        """
        answer = await self._ask({"do": "look"})
        if answer["error"]:
            self._silences += 1
            return OpenFiles(0, scratch.FULL if self._silences >= MOST_SILENCES else 0)
        self._silences = 0
        return OpenFiles(answer["descriptors"], answer["deleted_bytes"])

    def take_pidfd(self) -> int | None:
        """A pidfd of the init, for the caller to wait for and close; None if it is gone, never said
        who it is, or cannot be watched. The init ends last, after all else in the sandbox."""
        taken, self._pidfd = self._pidfd, None
        return taken

    def close(self) -> None:
        """Give no more orders."""
        if self._orders.fileno() >= 0:
            asyncio.get_running_loop().remove_reader(self._orders.fileno())
            self._orders.close()
            self._answers.put_nowait({"error": "the worker has ended"})

    async def _ask(self, order: dict[str, str]) -> dict[str, Any]:
        async with self._turn:
            while not self._answers.empty():  # of an order that was given up
                self._answers.get_nowait()
            try:
                self._orders.send(json.dumps(order).encode())
                async with asyncio.timeout(ANSWER_S):
                    return await self._answers.get()
            except (OSError, TimeoutError) as error:
                return {"error": str(error) or f"no answer for {ANSWER_S:g} s"}

    def _read(self) -> None:
        ancillary_bytes = socket.CMSG_SPACE(CREDENTIALS.size)
        with contextlib.suppress(BlockingIOError):
            while True:
                try:
                    data, more, _, _ = self._orders.recvmsg(_ANSWER_BYTES, ancillary_bytes)
                except ConnectionError:
                    data, more = b"", []
                if not data:
                    self.close()
                    return
                self._hear(json.loads(data), more)

    def _hear(self, said: dict[str, Any], more: list[tuple[int, int, bytes]]) -> None:
        match said["is"]:
            case "init":
                # It has ended meanwhile, or no descriptor is left. It is not tried again later: by
                # then its id may be somebody else's, whose end would be waited for.
                with contextlib.suppress(OSError):
                    self._pidfd = os.pidfd_open(_sender(more))
            case "worker":
                self._worker = _sender(more)
            case _:
                self._answers.put_nowait(said)


def _sender(more: list[tuple[int, int, bytes]]) -> int:
    process: int = next(CREDENTIALS.unpack(value)[0] for _, _, value in more)
    return process


def node_of(need: str) -> str:
    """Where a worker finds the device for a need in its sandbox."""
    return f"{DEVICES}/{need}"


def _real(node: str) -> str:
    """Without links: they would lead elsewhere in the sandbox."""
    return os.path.realpath(node)
