"""A serial line on the event loop, by pyserial; what goes wrong with it fails the behaviour.

A plugin that imports this locks pyserial with it (`nondum-sdk[serial]`).
"""

from __future__ import annotations

import asyncio
import termios
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType

import serial

from nondum.sdk.errors import BehaviourFailed, Problem

FAILED = "SERIAL_FAILED"
_WRITE_TIMEOUT_S = 0.5


class SerialLine:
    """An open port, ours alone. A context manager: leaving it closes the port.

    All of it raises `BehaviourFailed` (SERIAL_FAILED): the port cannot be opened, read or written,
    or its device has gone.
    """

    def __init__(self, node: str, baud: int) -> None:
        self._node = node
        self._waits: asyncio.AbstractEventLoop | None = None
        """The loop on which bytes are waited for."""
        with self._translated():
            self._port = serial.Serial(
                node, baud, timeout=0, write_timeout=_WRITE_TIMEOUT_S, exclusive=True
            )

    def send(self, data: bytes) -> None:
        """Write at once; never waits longer than half a second."""
        with self._translated():
            self._port.write(data)

    async def receive(self) -> bytes:
        """The bytes that have come, after waiting for the first of them."""
        self._waits, ready = asyncio.get_running_loop(), asyncio.Event()
        # Only while somebody waits: unread bytes would keep the loop busy otherwise.
        self._waits.add_reader(self._port.fileno(), ready.set)
        try:
            await ready.wait()
        finally:
            self._wait_no_more()
        with self._translated():
            return bytes(self._port.read(max(1, self._port.in_waiting)))

    def __enter__(self) -> SerialLine:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._wait_no_more()  # what is opened next may have the descriptor's number
        self._port.close()

    def _wait_no_more(self) -> None:
        if self._waits is not None:
            self._waits.remove_reader(self._port.fileno())
            self._waits = None

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        # pyserial's own errors are OSErrors too; those of termios, which it lets through when the
        # device is pulled between open and tcsetattr, are not.
        except (OSError, termios.error) as error:
            raise BehaviourFailed(
                Problem(FAILED, str(error), where=self._node, fix="check the cable")
            ) from error
