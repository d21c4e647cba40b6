"""A serial port that ends in this program: the master side of a pseudo-terminal."""

from __future__ import annotations

import os
import pty
import select
import tty


class Port:
    """Raw bytes to and from the program that opens `path`. While no program reads, bytes are lost,
    as on a real line without flow control."""

    def __init__(self) -> None:
        # The terminal end stays open here too: drivers may come and go without a hang-up.
        self._master, self._terminal = pty.openpty()
        tty.setraw(self._terminal)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._terminal)

    def read(self, timeout_s: float) -> bytes:
        """What has arrived, after waiting for it at most so long."""
        ready, _, _ = select.select([self._master], [], [], timeout_s)
        return os.read(self._master, 4096) if ready else b""

    def write(self, data: bytes) -> int:
        """Send; answers how many bytes the kernel took."""
        try:
            return os.write(self._master, data) if data else 0
        except BlockingIOError:
            return 0

    def fileno(self) -> int:
        return self._master

    def hang_up(self) -> None:
        """End the line: a program that has it open sees a hang-up, and none can open it again."""
        for end in (self._master, self._terminal):
            if end >= 0:
                os.close(end)
        self._master = self._terminal = -1

    def close(self) -> None:
        self.hang_up()
