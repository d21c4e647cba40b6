"""A serial port that ends at a unix socket: what a serial adapter of QEMU's is connected to."""

from __future__ import annotations

import os
import select
import socket
from pathlib import Path

LINE_BYTES = 4096
"""Size of the send buffer: as small as the kernel allows, since a line keeps nothing."""


class SocketPort:
    """Raw bytes to and from one client at a time, the newest; clients may come and go. What is sent
    while no client is connected, or none reads, is lost, as on a real line without flow control."""

    def __init__(self, path: Path) -> None:
        self.path = str(path)
        self._peer: socket.socket | None = None
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(self.path)
        self._listener.listen()

    def read(self, timeout_s: float) -> bytes:
        """What has arrived, after waiting for it at most so long."""
        ends = [self._listener] if self._peer is None else [self._listener, self._peer]
        ready, _, _ = select.select(ends, [], [], timeout_s)
        if self._listener in ready:
            self._welcome()
            return b""
        return self._received(self._peer) if self._peer in ready and self._peer else b""

    def write(self, data: bytes) -> int:
        """Send; answers how many bytes the kernel took."""
        if self._peer is None or not data:
            return 0
        try:
            return self._peer.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            self._let_go()
            return 0

    def close(self) -> None:
        """End the line."""
        self._let_go()
        self._listener.close()

    def _received(self, peer: socket.socket) -> bytes:
        try:
            data = peer.recv(4096)
        except OSError:
            data = b""
        if not data:
            self._let_go()
        return data

    def _welcome(self) -> None:
        self._let_go()
        self._peer, _ = self._listener.accept()
        os.set_blocking(self._peer.fileno(), False)
        self._peer.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, LINE_BYTES)

    def _let_go(self) -> None:
        if self._peer is not None:
            self._peer.close()
            self._peer = None
