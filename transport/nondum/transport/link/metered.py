"""Packets with a limit on their number and bytes a second: a flood ends its own connection."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.packets import Handle, OnClosed, OnPacket, Packets, discard
from nondum.transport.link.token_bucket import TokenBucket

RATE_HZ = 1000.0
"""Packets a second that a worker may send for long."""
BURST = 5000.0
"""Packets that it may send at once."""
BYTES_S = 1024 * 1024
"""Bytes a second that a worker may send for long: what is bulky travels as a stream."""
BURST_BYTES = 16 * 1024 * 1024


class MeteredPackets:
    """One end of a connection, which it owns; more than it may send is a violation."""

    def __init__(self, packets: Packets, rate_hz: float = RATE_HZ, burst: float = BURST) -> None:
        self._packets = packets
        self._rate_hz = rate_hz
        self._now_s = asyncio.get_running_loop().time
        self._bucket = TokenBucket(rate_hz, burst, self._now_s())
        self._bytes = TokenBucket(BYTES_S, BURST_BYTES, self._now_s())
        self.shares_memory = packets.shares_memory

    def open(self, on_packet: OnPacket, on_closed: OnClosed) -> None:
        """Begin to read (see `Packets`)."""

        def count(data: bytes, handles: tuple[Handle, ...]) -> None:
            now_s = self._now_s()
            if not self._bucket.take(1, now_s):
                flood = f"{self._rate_hz:.0f} packets"
            elif not self._bytes.take(len(data), now_s):
                flood = f"{BYTES_S // 1024} KiB"
            else:
                on_packet(data, handles)
                return
            discard(handles)
            self._packets.close()
            on_closed(ProtocolViolation(_flooded(flood)))

        self._packets.open(count, on_closed)

    def send(self, data: bytes, handles: Sequence[Handle] = ()) -> bool:
        """Send a packet (see `Packets`)."""
        return self._packets.send(data, handles)

    def when_writable(self, callback: Callable[[], None]) -> None:
        """Call back once (see `Packets`)."""
        self._packets.when_writable(callback)

    def close(self) -> None:
        """Stop and let go."""
        self._packets.close()


def _flooded(what: str) -> Problem:
    return Problem("BACKPRESSURE", f"more than {what} a second came, for long")
