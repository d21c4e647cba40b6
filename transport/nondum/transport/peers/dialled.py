"""A ZeroMQ socket that was dialled with: what comes over it, and what becomes of its connection."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

import zmq

from nondum.sdk.errors import Problem
from nondum.transport.peers import descriptors
from nondum.transport.peers.drained import Drained, OnFrames
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.monitor import SocketEvent, Watch


class Dialled:
    """One socket, connected to one address. `close` it."""

    def __init__(
        self,
        make: Callable[[], zmq.Socket[bytes]],
        address: str,
        on_frames: OnFrames,
        on_event: Callable[[SocketEvent], None],
    ) -> None:
        """`make` the socket and connect it. Raises `PeerRefused`: ADDRESS_MALFORMED, or
        DIAL_IMPOSSIBLE where there are no descriptors for it, now."""
        with contextlib.ExitStack() as taken:
            try:
                socket = make()
                taken.callback(socket.close, 0)
                self.is_sealed = int(socket.getsockopt(zmq.MECHANISM)) == zmq.CURVE
                """Whether what comes is encrypted (CURVE)."""
                self.socket = Drained(socket, on_frames)
                taken.callback(self.socket.close)
                self._monitor = Watch(socket, on_event)
                taken.callback(self._monitor.close)
            except (OSError, zmq.ZMQError) as error:
                told = f"nothing can be dialled now: {error.strerror}"
                problem = Problem("DIAL_IMPOSSIBLE", told, fix=descriptors.remedy(error))
                raise PeerRefused(problem) from error
            try:
                socket.connect(address)
            except zmq.ZMQError as error:
                told = f"the address cannot be dialled: {error.strerror}"
                problem = Problem("ADDRESS_MALFORMED", told, where=address)
                raise PeerRefused(problem) from error
            taken.pop_all()

    def close(self, linger_ms: int = 0) -> None:
        """Let go of the socket; what was sent may leave for `linger_ms` more."""
        self._monitor.close()
        self.socket.close(linger_ms)
