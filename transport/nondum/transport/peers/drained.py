"""A plain ZeroMQ socket on an asyncio loop. (zmq.asyncio's futures cost twice the time.)

Its descriptor is edge-triggered: it must be read until nothing is left, and its events looked at
again after every send, or a message may wait for ever.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from enum import Enum
from typing import TypeAlias

import zmq

AT_ONCE = 100
"""Messages that are taken in before others have their turn on the loop."""

OnFrames: TypeAlias = Callable[[list[zmq.Frame]], None]


class Sent(Enum):
    """What became of a message."""

    SENT = "sent"
    """Handed to ZeroMQ; it may still be lost with the connection."""
    FULL = "full"
    """As many as may wait are waiting."""
    GONE = "gone"
    """There is no such connection any more."""


class Drained:
    """A socket, which it owns, and what is called with every message."""

    def __init__(self, socket: zmq.Socket[bytes], on_frames: OnFrames) -> None:
        self._socket, self._on_frames = socket, on_frames
        self._loop = asyncio.get_running_loop()
        self._descriptor = socket.fileno()
        self._again: asyncio.Handle | None = None
        self.is_closed = False
        self._is_held = False
        self._loop.add_reader(self._descriptor, self.drain)
        self._look_again()

    def send(self, frames: Sequence[bytes | memoryview | zmq.Frame]) -> Sent:
        """Send one message, without waiting. What is no `zmq.Frame` is copied."""
        if self.is_closed:
            return Sent.GONE
        try:
            for frame in frames[:-1]:
                self._socket.send(frame, zmq.DONTWAIT | zmq.SNDMORE)
            self._socket.send(frames[-1], zmq.DONTWAIT)
        except zmq.Again:
            return Sent.FULL
        except zmq.ZMQError as error:
            if error.errno in (zmq.EHOSTUNREACH, zmq.ENOTSOCK, zmq.ETERM):
                return Sent.GONE
            raise
        finally:
            self._look_again()
        return Sent.SENT

    def close(self, linger_ms: int = 0) -> None:
        """Let go of the socket; what was sent may leave for `linger_ms` more."""
        if self.is_closed:
            return
        self.is_closed = True
        self._loop.remove_reader(self._descriptor)
        if self._again is not None:
            self._again.cancel()
        self._socket.close(linger_ms)

    def hold(self) -> None:
        """Take nothing in until `release`: what comes waits in ZeroMQ, and then at the sender."""
        if not self._is_held and not self.is_closed:
            self._is_held = True
            self._loop.remove_reader(self._descriptor)

    def release(self) -> None:
        """Take in again what comes."""
        if self._is_held and not self.is_closed:
            self._is_held = False
            self._loop.add_reader(self._descriptor, self.drain)
            self._look_again()

    def _look_again(self) -> None:
        """Drain on the loop's next turn if something came since the last look."""
        if (
            self._again is None
            and not self._is_held
            and not self._socket.closed
            and int(self._socket.getsockopt(zmq.EVENTS)) & zmq.POLLIN
        ):
            self._again = self._loop.call_soon(self.drain)

    def drain(self) -> bool:
        """Take in what has come, `AT_ONCE` at most; False when more may wait.

        Also called when the end of a connection is told before what came over it, by the monitor.
        """
        if self._again is not None:
            self._again.cancel()
            self._again = None
        for _ in range(AT_ONCE):
            if self.is_closed:
                return True
            if self._is_held:
                return False
            try:
                frames = self._socket.recv_multipart(zmq.DONTWAIT, copy=False)
            except zmq.Again:
                return True
            self._on_frames(frames)
        if not self.is_closed:
            self._look_again()
        return False
