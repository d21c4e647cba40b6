"""A serial line on the event loop; what goes wrong with it is `LineLost`."""

from __future__ import annotations

import asyncio
import termios
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType

import serial


class LineLost(Exception):
    """The port cannot be opened or read, or its device has gone."""


class Line:
    """An open port, ours alone. A context manager: leaving it closes the port."""

    def __init__(self, node: str, baud: int) -> None:
        with _translated():
            self._port = serial.Serial(node, baud, timeout=0, exclusive=True)

    async def receive(self) -> bytes:
        """The bytes that have come, after waiting for the first of them."""
        loop, ready = asyncio.get_running_loop(), asyncio.Event()
        # Only while somebody waits: unread bytes would keep the loop busy otherwise.
        loop.add_reader(self._port.fileno(), ready.set)
        try:
            await ready.wait()
        finally:
            loop.remove_reader(self._port.fileno())
        with _translated():
            return bytes(self._port.read(max(1, self._port.in_waiting)))

    def __enter__(self) -> Line:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._port.close()


@contextmanager
def _translated() -> Iterator[None]:
    try:
        yield
    # pyserial's own errors are OSErrors too; those of termios, which it lets through when the
    # device is pulled between open and tcsetattr, are not.
    except (OSError, termios.error) as error:
        raise LineLost(str(error)) from error
