"""Packets as long as wanted, over a connection whose packets are short."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

from nondum.host.rpc.pieces import Joined, cut
from nondum.sdk.errors import ProtocolViolation
from nondum.sdk.packets import Handle, OnClosed, OnPacket, Packets


class PiecedPackets:
    """One end, which owns its connection. It carries no descriptors."""

    shares_memory = False

    def __init__(self, packets: Packets, limit: int) -> None:
        """`limit`: bytes of a packet that is received."""
        self._packets = packets
        self._joined = Joined(limit)
        self._unsent: deque[bytes] = deque()
        self._on_sent: Callable[[], None] | None = None

    def open(self, on_packet: OnPacket, on_closed: OnClosed) -> None:
        """Begin to read (see `Packets`)."""

        def receive(piece: bytes, handles: tuple[Handle, ...]) -> None:
            try:
                packet = self._joined.add(piece)
            except ProtocolViolation as violation:
                self.close()
                on_closed(violation)
                return
            if packet is not None:
                on_packet(packet, handles)

        self._packets.open(receive, on_closed)

    def send(self, data: bytes, handles: Sequence[Handle] = ()) -> bool:
        """Send a packet (see `Packets`); what the other end cannot take yet waits here."""
        assert not handles, "pieces carry no descriptors"
        if self._unsent:
            return False
        self._unsent.extend(cut(data))
        self._flush()
        return True

    def when_writable(self, callback: Callable[[], None]) -> None:
        """Call back once (see `Packets`)."""
        self._on_sent = callback

    def close(self) -> None:
        """Stop and let go; what waits is lost."""
        self._unsent.clear()
        self._packets.close()

    def _flush(self) -> None:
        while self._unsent:
            if not self._packets.send(self._unsent[0]):
                self._packets.when_writable(self._flush)
                return
            self._unsent.popleft()
        on_sent, self._on_sent = self._on_sent, None
        if on_sent is not None:
            on_sent()
