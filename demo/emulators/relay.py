"""An LCUS-1 USB relay: four bytes (A0, channel, 0 or 1, sum of the three) latch it; no answer."""

from __future__ import annotations


class Relay:
    """One channel; `closed` means that the load has current."""

    def __init__(self) -> None:
        self.closed = False
        self._typed = bytearray()

    def receive(self, data: bytes) -> None:
        """Take bytes off the line; what is no command for channel 1 changes nothing."""
        self._typed += data
        while len(self._typed) >= 4:
            start, channel, operation, total = self._typed[:4]
            if start != 0xA0 or total != (start + channel + operation) & 0xFF:
                del self._typed[:1]
                continue
            del self._typed[:4]
            if channel == 1 and operation in (0, 1):
                self.closed = bool(operation)
