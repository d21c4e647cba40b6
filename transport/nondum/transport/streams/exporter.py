"""Where readers of other hosts come for this host's streams: who is let in, and what each may have.

A connection carries one stream. ZeroMQ lets in the keys that hold a grant, and none else; the first
message claims one grant, which must be its key's; it holds for that connection.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Sequence

import zmq

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.transport.peers import tcp
from nondum.transport.peers.arrivals import Arrivals
from nondum.transport.peers.drained import Drained, Sent
from nondum.transport.peers.keys import HostKeys, PeerKey
from nondum.transport.peers.monitor import Watch
from nondum.transport.peers.proof import prove_enforced
from nondum.transport.peers.refusals import Refusals
from nondum.transport.peers.zap import ConnectionAttempt, Entry, ZapHandler
from nondum.transport.streams import packets, sockets
from nondum.transport.streams.outgoing import Outgoing
from nondum.transport.streams.packets import VERSION, Claim, Over

BEAT_S = 0.3
SECOND_LOOK_S = 0.02
LAST_WORDS_S = 0.2
"""How long a connection lasts after the reason of its end was sent."""

log = logging.getLogger(__name__)


class Exporter:
    """Serves granted streams. `await start(…)` it, and `close()` it."""

    def __init__(self, context: sockets.Context, keys: HostKeys) -> None:
        self._context, self._keys = context, keys
        self._loop = asyncio.get_running_loop()
        self._grants: dict[str, Outgoing] = {}
        self._claimed: dict[bytes, Outgoing] = {}
        self.refusals = Refusals(lambda refusal: log.info("a reader was refused: %s", refusal))
        self._arrivals = Arrivals(self.refusals.add, self._on_closed)
        self._zap: ZapHandler | None = None
        self._listener: Drained | None = None
        self._monitor: Watch | None = None
        self._beating: asyncio.TimerHandle | None = None

    async def start(self, interfaces: Sequence[str], port: int = 0) -> int:
        """Listen at a port, 0 for one that the system picks; the port.

        Raises `PeerRefused` (ZAP_INEFFECTIVE, ADDRESS_UNUSABLE).
        """
        self._zap = ZapHandler(self._context, self._judge)
        with contextlib.ExitStack() as taken:
            socket = sockets.listening(self._context, self._keys)
            taken.callback(socket.close, 0)
            await prove_enforced(socket, self._keys, self._zap.expect_probe)
            monitor = Watch(socket, self._arrivals.on_event)
            taken.callback(monitor.close)
            port = sockets.bind(socket, interfaces, port)
            self._listener = Drained(socket, self._on_frames)
            self._monitor = monitor
            taken.pop_all()
        self._beating = self._loop.call_later(BEAT_S, self._beat)
        return port

    def grant(
        self,
        token: str,
        reader: PeerKey,
        kind: str,
        on_can_send: Callable[[], None],
        on_over: Callable[[Problem], None],
    ) -> Outgoing:
        """Let a reader have one stream of type `kind`, once (see `Outgoing`).

        The token must be new; it names the grant, and is no secret: the reader's key is proved.
        """
        made = Outgoing(token, reader, kind, on_can_send, on_over)
        self._grants[token] = made
        return made

    def close(self) -> None:
        """End all streams and listen no more."""
        for outgoing in self._grants.values():
            outgoing.end(Problem("STREAM_ENDED", "the host ends its bridge"))
        self._grants.clear()
        if self._beating is not None:
            self._beating.cancel()
        if self._monitor is not None:
            self._monitor.close()
        if self._listener is not None:
            self._listener.close(int(LAST_WORDS_S * 1000))
        if self._zap is not None:
            self._zap.close()

    def _judge(self, attempt: ConnectionAttempt) -> Entry:
        is_awaited = any(
            granted.reader == attempt.key and granted.way is None and not granted.is_over
            for granted in self._grants.values()
        )
        is_proved = attempt.domain == sockets.DOMAIN and attempt.mechanism == "CURVE"
        return Entry.LET_IN if is_proved and is_awaited else Entry.TURNED_AWAY

    def _on_frames(self, frames: list[zmq.Frame]) -> None:
        routing_id, data = frames[0].bytes, frames[-1]
        outgoing = self._claimed.get(routing_id)
        try:
            if len(frames) != 2:
                raise ProtocolViolation(Problem("BRIDGE_PACKET", "a reader's message has one part"))
            message = packets.read_asked(data.bytes)
            if outgoing is None:
                self._claim(routing_id, data, message)
            elif problem := outgoing.receive(message, len(data)):
                outgoing.break_off(problem)
        except ProtocolViolation as violation:
            if outgoing is not None:
                outgoing.break_off(violation.problems[0])
            else:
                self._turn_away(routing_id, data, violation.problems[0])

    def _claim(self, routing_id: bytes, data: zmq.Frame, message: packets.Asked) -> None:
        if not isinstance(message, Claim):
            raise ProtocolViolation(Problem("BRIDGE_PACKET", "a reader begins with its claim"))
        if message.version != VERSION:
            raise ProtocolViolation(_other_version(message.version))
        granted = self._grants.get(message.token)
        reader = data.get("User-Id")
        if (
            granted is None
            or granted.reader != reader
            or granted.way is not None
            or granted.is_over
        ):
            raise ProtocolViolation(
                Problem("STREAM_NOT_GRANTED", "the claimed stream was not granted to this key")
            )
        assert self._listener is not None
        descriptor = int(data.get(zmq.SRCFD))
        self._arrivals.became_peer(descriptor)
        self._claimed[routing_id] = granted
        granted.claimed(_Way(self._listener, routing_id, descriptor))

    def _turn_away(self, routing_id: bytes, data: zmq.Frame, problem: Problem) -> None:
        assert self._listener is not None
        way = _Way(self._listener, routing_id, int(data.get(zmq.SRCFD)))
        way.send([packets.told(Over(problem))])
        way.cut()

    def _on_closed(self, descriptor: int) -> None:
        if self._listener is None or self._listener.is_closed:
            return
        self._listener.drain()
        for outgoing in list(self._claimed.values()):
            if outgoing.way is not None and outgoing.way.descriptor == descriptor:
                outgoing.try_way()
                self._loop.call_later(SECOND_LOOK_S, outgoing.try_way)

    def _beat(self) -> None:
        self._beating = self._loop.call_later(BEAT_S, self._beat)
        self._arrivals.cut_overdue()
        for outgoing in list(self._grants.values()):
            outgoing.look()
        self._grants = {token: one for token, one in self._grants.items() if not one.is_over}
        self._claimed = {id_: one for id_, one in self._claimed.items() if not one.is_over}


def _other_version(theirs: int) -> Problem:
    return Problem(
        "BRIDGE_VERSION",
        "the two hosts speak different versions of the protocol for streams",
        need=str(VERSION),
        have=str(theirs),
        fix=f"update nondum on the host that {'asked' if theirs < VERSION else 'has the stream'}",
    )


class _Way:
    """A connection to the listening socket."""

    def __init__(self, listener: Drained, routing_id: bytes, descriptor: int) -> None:
        self._listener, self._routing_id, self.descriptor = listener, routing_id, descriptor
        self._end = tcp.other_end(descriptor)

    def send(self, parts: Sequence[bytes | memoryview]) -> Sent:
        """Send without waiting."""
        return self._listener.send([self._routing_id, *parts])

    def cut(self) -> None:
        """End the connection, after what was sent."""
        loop = asyncio.get_running_loop()
        loop.call_later(LAST_WORDS_S, tcp.cut, self.descriptor, self._end)
