"""Packets that wait, in order, until the other end of their connection takes them."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Sequence

from nondum.sdk.packets import Handle, Packets, discard


class Outbox:
    """What is to be sent over a connection, which stays the caller's. `clear` it."""

    def __init__(self, packets: Packets, on_drained: Callable[[], None] = lambda: None) -> None:
        """`on_drained` is called each time that nothing waits any more."""
        self._packets, self._on_drained = packets, on_drained
        self._waiting: deque[tuple[bytes, tuple[Handle, ...]]] = deque()
        self.bytes = 0
        """Of the packets that wait."""

    def __len__(self) -> int:
        return len(self._waiting)

    def send(self, data: bytes, handles: Sequence[Handle] = ()) -> None:
        """Send a packet, at once or later. The caller keeps its handles."""
        if not self._waiting and self._packets.send(data, handles):
            return
        self.bytes += len(data)
        kept = tuple(os.dup(h) if isinstance(h, int) else h for h in handles)
        self._waiting.append((data, kept))
        if len(self._waiting) == 1:
            self._packets.when_writable(self._flush)

    def clear(self) -> None:
        """Send nothing more."""
        while self._waiting:
            discard(self._waiting.popleft()[1])

    def _flush(self) -> None:
        while self._waiting:
            data, handles = self._waiting[0]
            if not self._packets.send(data, handles):
                self._packets.when_writable(self._flush)
                return
            self._waiting.popleft()
            self.bytes -= len(data)
            for handle in handles:
                if isinstance(handle, int):
                    os.close(handle)  # the duplicate that waited; the other end has its own
        self._on_drained()
