"""One stream's way to its one reader on another host, from the grant to the end."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from nondum.sdk.errors import Problem
from nondum.sdk.messages import Buffer
from nondum.transport.link.token_bucket import TokenBucket
from nondum.transport.peers import tcp
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.keys import PeerKey
from nondum.transport.streams import packets
from nondum.transport.streams.packets import Asked, Claim, Coding, Handled, Over, Ping, Pong
from nondum.transport.streams.window import Window

CLAIM_S = 10.0
"""How long a grant waits for its reader."""
SILENT_S = 3.0
"""A reader that says nothing for so long is gone."""
ASKED_BYTES = 64 * 1024
"""What a reader may send beyond the messages that came whole: one that never ends is cut."""


class Way(Protocol):
    """The connection that a grant was claimed over."""

    descriptor: int

    def send(self, parts: Sequence[bytes | memoryview]) -> Sent:
        """Send without waiting."""

    def cut(self) -> None:
        """End the connection, after what was sent."""


class Outgoing:
    """A granted stream. `end` it."""

    def __init__(
        self,
        token: str,
        reader: PeerKey,
        kind: str,
        on_can_send: Callable[[], None],
        on_over: Callable[[Problem], None],
    ) -> None:
        """`on_can_send` is called when a message may be sent that could not before.

        `on_over` is called once when the reader is gone, not after `end`.
        """
        self.token, self.reader, self.kind = token, reader, kind
        self.frames_sent = 0
        self.bytes_sent = 0
        """Of headers and bulk, before they are sealed."""
        self._on_can_send, self._on_over = on_can_send, on_over
        self._loop = asyncio.get_running_loop()
        self._heard_s = self._loop.time()
        self._heard_bytes = 0
        self._window = Window()
        self._pings = TokenBucket(packets.PINGS_HZ, packets.PINGS_HZ, self._heard_s)
        self._way: Way | None = None
        self.is_over = False

    @property
    def way(self) -> Way | None:
        """The connection; None until the grant is claimed."""
        return self._way

    @property
    def can_send(self) -> bool:
        """Whether a message may be sent now."""
        return self._way is not None and not self.is_over and self._window.can_send

    def send(self, coding: Coding, header: Mapping[str, Any], bulk: Buffer | None) -> None:
        """Send a message; `can_send` must hold.

        Raises `ProtocolViolation` for a header that fits no packet.
        """
        assert self._way is not None, "nothing can be sent before the grant is claimed"
        self.frames_sent += 1
        pieces = () if bulk is None else packets.cut(bulk)
        frame = packets.Frame(self.frames_sent, coding, header, pieces)
        parts: list[bytes | memoryview] = [packets.head(frame), *pieces]
        length = sum(map(len, parts))
        match self._way.send(parts):
            case Sent.SENT:
                self.bytes_sent += length
                self._window.sent(frame.seq, length, self._loop.time())
            case Sent.GONE:
                self.break_off(_gone())
            case Sent.FULL:  # windows are smaller than what may wait: the frame is dropped
                pass

    def claimed(self, way: Way) -> None:
        """The reader is there."""
        self._way, self._heard_s = way, self._loop.time()
        way.send([packets.told(packets.Opened(self.kind))])
        self._on_can_send()

    def receive(self, message: Asked, length: int) -> Problem | None:
        """Take in a message of the reader; the problem with it, if there is one."""
        now_s = self._loop.time()
        self._heard_s = now_s
        self._heard_bytes += length
        assert self._way is not None
        match message:
            case Handled(seq):
                state = tcp.state(self._way.descriptor)
                round_trip_s = 0.0 if state is None else state.round_trip_s
                if not self._window.handled(seq, now_s, round_trip_s):
                    return Problem("BRIDGE_PACKET", f"frame {seq} is not the next to be handled")
                if self._window.can_send:
                    self._on_can_send()
            case Ping() if not self._pings.take(1, now_s):
                return Problem("BRIDGE_PACKET", "more signs of life than are needed")
            case Ping(at_s):
                if self._way.send([packets.told(Pong(at_s, self._loop.time()))]) is Sent.GONE:
                    self.break_off(_gone())
            case Claim():
                return Problem("BRIDGE_PACKET", "the stream was claimed already")
        return None

    def look(self) -> None:
        """Give up a reader that does not come, is silent, or sends without an end."""
        if self.is_over:
            return
        quiet_s = self._loop.time() - self._heard_s
        if self._way is None:
            if quiet_s > CLAIM_S:
                self.break_off(
                    Problem("STREAM_UNCLAIMED", f"no reader claimed it within {CLAIM_S:g} s")
                )
            return
        state = tcp.state(self._way.descriptor)
        received = 0 if state is None else state.bytes_received
        if quiet_s > SILENT_S:
            self.break_off(Problem("STREAM_SILENT", f"its reader said nothing for {SILENT_S:g} s"))
        elif received > 16 * self._heard_bytes + ASKED_BYTES:  # each message is sealed and framed
            self.break_off(Problem("BRIDGE_PACKET", "a message that does not end"))

    def try_way(self) -> None:
        """The connection may have ended: see whether it is there."""
        if self._way is None or self.is_over:
            return
        if self._way.send([packets.told(Pong(0.0, 0.0))]) is Sent.GONE:
            self.break_off(_gone())

    def break_off(self, problem: Problem) -> None:
        """End it because of its reader, or for want of one."""
        if not self.is_over:
            self.end(problem)
            self._on_over(problem)

    def end(self, problem: Problem) -> None:
        """End it, and tell the reader why; nothing more is called."""
        if self.is_over:
            return
        self.is_over = True
        if self._way is not None:
            self._way.send([packets.told(Over(problem))])
            self._way.cut()


def _gone() -> Problem:
    return Problem("STREAM_LOST", "the connection to its reader has ended")
