"""One stream of another host, as its bridge here reads it: over one connection, claimed once."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial

import zmq

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.transport.link.token_bucket import TokenBucket
from nondum.transport.peers import tcp
from nondum.transport.peers.dialled import Dialled
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import HostKeys, PeerKey
from nondum.transport.peers.monitor import SocketEvent
from nondum.transport.streams import packets, sockets
from nondum.transport.streams.clocks import Clocks
from nondum.transport.streams.packets import Claim, Frame, Handled, Opened, Over, Ping, Pong
from nondum.transport.streams.window import Window

BEAT_S = 0.3
SILENT_S = 1.2
"""A connection over which no byte came for so long is dead: pings are answered every beat, and what
is slow still trickles."""
OPEN_S = 5.0
"""How long it may take to reach the other bridge."""


_NEVER_SLOW_S = float("inf")


@frozen
class Place:
    """Where a stream is to be had."""

    addresses: tuple[str, ...]
    """`tcp://HOST:PORT`, all tried at once."""
    owner: PeerKey
    """The key of the bridge there."""
    token: str
    """Of the grant."""


class Incoming:
    """A stream's connection. `close` it."""

    def __init__(
        self,
        context: sockets.Context,
        keys: HostKeys,
        place: Place,
        *,
        on_opened: Callable[[str], None],
        on_frame: Callable[[Frame], None],
        on_over: Callable[[Problem], None],
    ) -> None:
        """`on_opened` is told the stream's type. Answer each `on_frame` by `handled`, in order: the
        first comes once `clocks` can tell what its stamp means.

        `on_over` is called once, at the end or instead of the beginning; not after `close`.
        """
        self.clocks = Clocks()
        self.bytes_received = 0
        self._place = place
        self._on_opened, self._on_frame, self._on_over = on_opened, on_frame, on_over
        self._loop = asyncio.get_running_loop()
        self._began_s = self._loop.time()
        self._pongs = TokenBucket(packets.PINGS_HZ, packets.PINGS_HZ, self._began_s)
        self._window = Window()
        """As the owner must keep it: what breaks it would fill the memory here."""
        self._early: list[Frame] = []
        """Came before the owner's clock was known."""
        self._is_opened = False
        self._is_closed = False
        self._descriptor: int | None = None
        self._winner: _Attempt | None = None
        self._problem = Problem("STREAM_UNREACHABLE", "no address of its bridge was given")
        self._attempts: list[_Attempt] = []
        self._beating = self._loop.call_later(BEAT_S, self._beat)
        for address in place.addresses:
            self._dial(partial(sockets.dialling, context, keys, place.owner), address)
        if not self._attempts:
            self._loop.call_soon(self._lose, self._problem)

    def handled(self, seq: int) -> None:
        """A frame was taken in: the owner may send another one."""
        self._window.handled(seq, self._loop.time(), _NEVER_SLOW_S)
        self._say(Handled(seq))

    def close(self) -> None:
        """Let go of it."""
        if not self._is_closed:
            self._is_closed = True
            self._beating.cancel()
            for attempt in self._attempts:
                attempt.close()

    def _dial(self, make: Callable[[], zmq.Socket[bytes]], address: str) -> None:
        try:
            self._attempts.append(_Attempt(self, make, address))
        except PeerRefused as refused:
            self._problem = refused.problems[0]

    def connected(self, attempt: _Attempt) -> None:
        """A connection stands, and both ends have proved their keys: the first one is kept."""
        if self._winner is not None or self._is_closed:
            return
        self._winner, self._descriptor = attempt, attempt.descriptor
        for other in self._attempts:
            if other is not attempt:
                other.close()
        self._attempts = [attempt]
        self._say(Claim(packets.VERSION, self._place.token))
        self._say(Ping(self._loop.time()))

    def failed(self, attempt: _Attempt, problem: Problem) -> None:
        """A connection has failed, or has ended."""
        attempt.close()
        if attempt in self._attempts:
            self._attempts.remove(attempt)
            if not self._attempts:
                self._lose(problem)

    def receive(self, frames: list[zmq.Frame]) -> None:
        """A message came over the connection that was kept."""
        now_s = self._loop.time()
        length = sum(len(frame) for frame in frames)
        self.bytes_received += length
        try:
            message = packets.read_told([frame.buffer for frame in frames])
        except ProtocolViolation as violation:
            self._lose(violation.problems[0])
            return
        match message:
            case Opened(kind) if not self._is_opened:
                self._is_opened = True
                self._on_opened(kind)
            case Frame(seq) if self._is_opened and self._window.can_send:
                self._window.sent(seq, length, now_s)
                if self.clocks.are_known:
                    self._on_frame(message)
                else:
                    self._early.append(message)
            case Pong(at_s, clock_s) if self._pongs.take(1, now_s):
                if at_s:
                    self.clocks.pong_received(at_s, clock_s, now_s)
                    self._hand_on_early()
            case Over(problem):
                self._lose(problem)
            case _:
                self._lose(Problem("BRIDGE_PACKET", "a message out of its turn"))

    def _hand_on_early(self) -> None:
        early, self._early = self._early, []
        for frame in early:
            if not self._is_closed:
                self._on_frame(frame)

    def _say(self, message: packets.Asked) -> None:
        if self._winner is not None and not self._is_closed:
            self._winner.send(packets.asked(message))

    def _beat(self) -> None:
        self._beating = self._loop.call_later(BEAT_S, self._beat)
        self._say(Ping(self._loop.time()))
        state = None if self._descriptor is None else tcp.state(self._descriptor)
        most = self.bytes_received * 1.25 + 2 * packets.MAX_BULK
        if state is not None and state.bytes_received > most:
            self._lose(Problem("BRIDGE_PACKET", "a message that does not end"))
            return
        if not self._is_opened:
            if self._loop.time() - self._began_s > OPEN_S:
                told = f"its bridge did not answer in {OPEN_S:g} s"
                self._lose(Problem("STREAM_UNREACHABLE", told))
            return
        if state is not None and state.quiet_s > SILENT_S:  # of one that is gone the monitor tells
            self._lose(Problem("STREAM_SILENT", f"nothing came for {SILENT_S:g} s"))

    def _lose(self, problem: Problem) -> None:
        if not self._is_closed:
            self.close()
            self._on_over(problem)


class _Attempt:
    """One connection to one address. `close` it."""

    def __init__(
        self, incoming: Incoming, make: Callable[[], zmq.Socket[bytes]], address: str
    ) -> None:
        """`make` its socket. Raises `PeerRefused`: ADDRESS_MALFORMED, or DIAL_IMPOSSIBLE where
        there are no descriptors for it."""
        self._incoming = incoming
        self.descriptor: int | None = None
        """Of the connection, once there is one."""
        self._dialled = Dialled(make, address, incoming.receive, self._on_event)

    def send(self, data: bytes) -> None:
        self._dialled.socket.send([data])

    def close(self) -> None:
        self._dialled.close()

    def _on_event(self, event: SocketEvent) -> None:
        if event.kind == zmq.EVENT_CONNECTED:
            self.descriptor = event.value
            return
        if event.kind == zmq.EVENT_HANDSHAKE_SUCCEEDED:
            self._incoming.connected(self)
            return
        self._dialled.socket.drain()  # the last words
        if event.kind == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
            problem = Problem("STREAM_NOT_GRANTED", "the bridge there does not let this one in")
        else:
            problem = Problem("STREAM_LOST", "the connection to its host has ended, or never began")
        self._incoming.failed(self, problem)
