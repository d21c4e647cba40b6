"""Sockets to other hosts in this process."""

from __future__ import annotations

import asyncio
import contextlib
import os
import resource
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import zmq

from nondum.sdk.errors import Problem
from nondum.transport.peers import descriptors
from nondum.transport.peers.arrivals import Arrivals
from nondum.transport.peers.connection_checks import Looks
from nondum.transport.peers.drained import Drained, Sent
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.gate import entry, judge
from nondum.transport.peers.heartbeat import BEAT_S
from nondum.transport.peers.identity import Identity, Security
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.link import LINGER_MS
from nondum.transport.peers.listener import HIGH_WATER, Context, dialling, listening
from nondum.transport.peers.messages import MAX_MESSAGE, Ping, encode
from nondum.transport.peers.monitor import Watch
from nondum.transport.peers.proof import prove_enforced
from nondum.transport.peers.received import MOST_AHEAD
from nondum.transport.peers.refusals import Reason, Refusal
from nondum.transport.peers.routes import AcceptedRoute, DialledRoute
from nondum.transport.peers.sockets import Owner, Receiver
from nondum.transport.peers.trust import Trust
from nondum.transport.peers.zap import ConnectionAttempt, Entry, ZapHandler

SECOND_LOOK_S = 0.02
"""ZeroMQ tells of a broken connection a little before sending over it fails."""
LOOK_S = 0.1
"""Time between two looks at what came over connections and is no whole message yet (see `Looks`).
What comes in between fills this process's memory.
"""


class LocalSockets:
    """A ZeroMQ context, its sockets, and the bounds of what comes over them (see `Sockets`)."""

    def __init__(self, me: Identity, trust: Trust, owner: Owner) -> None:
        """See `MakeSockets`."""
        self._me, self._trust, self._owner = me, trust, owner
        self._arrivals = Arrivals(owner.on_refusal, self._on_closed, owner.awake_s)
        self._context: Context | None = None
        self._loop = asyncio.get_running_loop()
        self._accepted: dict[bytes, AcceptedRoute] = {}
        self._dialled: list[DialledRoute] = []
        self._is_held = False
        self._zap: ZapHandler | None = None
        self._listener: Drained | None = None
        self._monitor: Watch | None = None
        self._beating: asyncio.TimerHandle | None = None
        self._looking: asyncio.TimerHandle | None = None
        self._looks = Looks()

    @property
    def pid(self) -> int:
        """This process."""
        return os.getpid()

    @property
    def strangers(self) -> int:
        """How many accepted connections are not a peer's yet."""
        return self._arrivals.strangers

    async def listen(self, addresses: Sequence[str]) -> tuple[str, ...]:
        """Listen (see `Sockets`)."""
        try:
            bound = await self._listen(addresses)
        except (OSError, zmq.ZMQError) as error:
            told = f"peers cannot be listened for there: {error.strerror}"
            where, fix = ", ".join(addresses), descriptors.remedy(error)
            raise PeerRefused(Problem("ADDRESS_UNUSABLE", told, where=where, fix=fix)) from error
        self._beating = self._loop.call_later(BEAT_S, self._beat)
        self._looking = self._loop.call_later(LOOK_S, self._look)
        return bound

    def dial(self, key: PeerKey, address: str, receiver: Receiver) -> DialledRoute:
        """Begin one connection (see `Sockets`)."""
        route = DialledRoute(partial(self._dialling, key), address, receiver)
        self._dialled = [*(one for one in self._dialled if not one.is_cut), route]
        if self._is_held:
            route.hold()
        return route

    def set_trust(self, trust: Trust) -> None:
        """Judge by this trust from now on."""
        self._trust = trust

    def hold(self) -> None:
        """Take in no messages until `release`; who connects is judged and bounded meanwhile."""
        self._is_held = True
        for socket in self._read():
            socket.hold()

    def release(self) -> None:
        """Take in messages again."""
        self._is_held = False
        for socket in self._read():
            socket.release()

    async def close(self) -> None:
        """Let go of everything; what was sent last may take a moment to leave."""
        for timer in (self._beating, self._looking):
            if timer is not None:
                timer.cancel()
        for route in self._dialled:
            route.cut()
        if self._monitor is not None:
            self._monitor.close()
        if self._listener is not None:
            self._listener.close(LINGER_MS)
        if self._zap is not None:
            self._zap.close()
        if self._context is not None:
            await asyncio.to_thread(self._context.term)

    async def _listen(self, addresses: Sequence[str]) -> tuple[str, ...]:
        """Raises `PeerRefused`, `zmq.ZMQError` and `OSError`, with no socket left open but that of
        the handler."""
        descriptors.see_that_there_are()
        context = self._opened()
        if self._zap is None:
            self._zap = ZapHandler(context, self._judge)
        with contextlib.ExitStack() as taken:
            socket = listening(context, self._me.keys)
            taken.callback(socket.close, 0)
            await prove_enforced(socket, self._me.keys, self._zap.expect_probe)
            monitor = Watch(socket, self._arrivals.on_event)
            taken.callback(monitor.close)
            bound = tuple(_bind(socket, address) for address in addresses)
            self._listener = Drained(socket, self._on_frames)
            self._monitor = monitor
            taken.pop_all()
        return bound

    def _dialling(self, key: PeerKey) -> zmq.Socket[bytes]:
        return dialling(self._opened(), self._me.keys, key)

    def _opened(self) -> Context:
        """The context of all sockets. Raises `OSError` and `zmq.ZMQError`."""
        if self._context is None:
            descriptors.see_that_there_are()
            self._context = zmq.Context()
        return self._context

    def _read(self) -> Iterator[Drained | DialledRoute]:
        """All that is read from."""
        if self._listener is not None:
            yield self._listener
        yield from self._dialled

    def _on_frames(self, frames: list[zmq.Frame]) -> None:
        """A message came to the listening socket."""
        data = frames[-1]
        proved = None
        if self._me.security is Security.CURVE:
            proved = PeerKey(str(data.get("User-Id")))
        route = self._route(frames[0].bytes, data, proved)
        route.received.delivered(frames[1:])
        if route.proved != proved:
            route.receiver.misused(Reason.NOT_PROVED)
        elif len(frames) != 2:
            route.receiver.misused(Reason.GARBAGE)
        else:
            route.receiver.received(data.bytes)

    def _route(self, routing_id: bytes, data: zmq.Frame, proved: PeerKey | None) -> AcceptedRoute:
        route = self._accepted.get(routing_id)
        if route is None:
            assert self._listener is not None
            descriptor, on_peer = int(data.get(zmq.SRCFD)), self._arrivals.became_peer
            route = AcceptedRoute(self._listener, routing_id, descriptor, on_peer, proved)
            for other in self._accepted.values():
                other.received.yield_to(route.received)
            self._accepted[routing_id] = route
            self._arrivals.spoke(descriptor)
            route.receiver = self._owner.on_accepted(route, proved)
        return route

    def _judge(self, attempt: ConnectionAttempt) -> Entry:
        reason = judge(attempt, self._me, self._trust)
        if reason is not None:
            now_s, told = self._loop.time(), "turned away at the handshake"
            self._owner.on_refusal(Refusal(reason, attempt.address, attempt.key, told, now_s))
        return entry(reason)

    def _on_closed(self, descriptor: int) -> None:
        """An accepted connection broke. Its descriptor may have been others' before and since, so
        all routes that had it are doubted."""
        if self._listener is None or self._listener.is_closed:
            return
        self._listener.drain()  # the goodbye may wait still
        for route in list(self._accepted.values()):
            if route.descriptor == descriptor:
                route.receiver.doubtful()
                self._loop.call_later(SECOND_LOOK_S, route.receiver.doubtful)

    def _beat(self) -> None:
        self._beating = self._loop.call_later(BEAT_S, self._beat)
        # Routes that were cut keep their ids until their connections are gone: what was read of
        # them before must not make a new one.
        for routing_id, route in list(self._accepted.items()):
            if route.is_cut and route.send(_PING) is Sent.GONE and route.drain():
                del self._accepted[routing_id]
                route.receiver.over(None)

    def _look(self) -> None:
        """Tell of the connections over which a message comes that does not end."""
        routes: list[AcceptedRoute | DialledRoute] = [*self._accepted.values(), *self._dialled]
        self._looking = self._loop.call_later(LOOK_S, self._look)
        if self._listener is not None:
            self._listener.drain()  # what makes a connection a peer's may wait to be read
        self._arrivals.cut_overdue()
        for route in self._looks.due(routes, _resident_bytes()):
            if not (route.is_peers or route.is_cut) or not _is_endless(route):
                continue
            if not route.is_cut:
                route.receiver.misused(Reason.ENDLESS)
            elif isinstance(route, AcceptedRoute):
                route.cut()  # it has no time for its last words


def _is_endless(route: AcceptedRoute | DialledRoute) -> bool:
    received = route.received
    if received is None:
        return False
    read = received.read()
    if received.ahead(read) <= MOST_AHEAD:
        return False
    # Whole messages may wait to be taken in, but no more than ZeroMQ lets wait.
    may_wait = 0 if route.drain() else HIGH_WATER * MAX_MESSAGE
    return received.ahead(read) > MOST_AHEAD + may_wait


def _resident_bytes() -> int:
    """Memory of this process (proc_pid_statm(5)); the most that it had where no descriptor is left
    to read that by."""
    try:
        fields = Path("/proc/self/statm").read_text(encoding="ascii").split()
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10
    return int(fields[1]) * os.sysconf("SC_PAGE_SIZE")


_PING = encode(Ping(1))


def _bind(socket: zmq.Socket[bytes], address: str) -> str:
    try:
        socket.bind(f"{address[:-1]}*" if address.endswith(":0") else address)
    except zmq.ZMQError as error:
        told = f"peers cannot be listened for there: {error}"
        raise PeerRefused(Problem("ADDRESS_UNUSABLE", told, where=address)) from error
    bound = socket.getsockopt(zmq.LAST_ENDPOINT)
    assert isinstance(bound, bytes)
    return bound.rstrip(b"\0").decode("ascii").replace("[::ffff:127.0.0.1]", "127.0.0.1")
