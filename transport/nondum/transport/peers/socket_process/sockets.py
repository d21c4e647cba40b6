"""The daemon's end: connections that a separate process holds (see `Sockets`).

When that process ends, by its memory limit or else, all connections are over; it is started again,
and listens where it did.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import socket
from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeAlias

from nondum.sdk.errors import NondumError, Problem, ProtocolViolation
from nondum.sdk.wire_fields import read_problem
from nondum.transport.peers import trust_file
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.heartbeat import BEAT_S
from nondum.transport.peers.identity import Identity, Security
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.messages import MAX_MESSAGE
from nondum.transport.peers.refusals import Reason, Refusal
from nondum.transport.peers.socket_process.pipe import WINDOW, Pipe, pipe_sockets, violation
from nondum.transport.peers.sockets import Owner, Receiver
from nondum.transport.peers.trust import Trust

START_S = 20.0
"""How long the process may take until it listens."""
GRACE_S = 2.0
"""How long it may take to end by itself."""
TOLD_S = 0.5
"""How long one that is gone from the pipe may take until it has ended, and how is known."""
FIRST_WAIT_S, LONGEST_WAIT_S = 0.1, 10.0
"""Before it is started again; what lives for longer than the longest wait begins with the first."""
MOST_UNANSWERED = 33
"""Ticks, 0.3 s apart while this loop runs, after which the process is taken to hang."""
MOST_WAITING = 2 * WINDOW * MAX_MESSAGE
"""Bytes that wait for the process: more than one peer's messages ever are. Peers are told nothing
more then."""
MOST_CONNECTIONS = 4096
"""Accepted by the process: far more than it lets in."""
_PIECE = 100_000
"""Characters of the trust in a packet."""

log = logging.getLogger(__name__)


class Process(Protocol):
    """What holds the sockets, while it runs."""

    @property
    def pid(self) -> int:
        """Its process id."""

    async def ended(self, grace_s: float) -> str:
        """Wait for its end, and bring it about when that takes longer; how it ended, in words."""


Start: TypeAlias = Callable[[socket.socket], Process]
"""Starts the process with its end of the pipe, which stays the caller's to close. Raises `OSError`.
"""


class SocketProcess:
    """Sockets in a process that is started with the first `listen`."""

    def __init__(self, me: Identity, trust: Trust, owner: Owner, *, start: Start) -> None:
        """See `MakeSockets`."""
        self._me, self._trust, self._owner, self._start = me, trust, owner, start
        self._loop = asyncio.get_running_loop()
        self._process: Process | None = None
        self.strangers = 0
        """How many accepted connections are not a peer's yet, as was told last."""
        self._addresses: tuple[str, ...] = ()
        self._pipe: Pipe | None = None
        self._routes: dict[int, _FarRoute] = {}
        self._numbers = itertools.count(1, 2)
        self._bound: asyncio.Future[tuple[str, ...]] | None = None
        self._since_s = 0.0
        self._wait_s = FIRST_WAIT_S
        self._unanswered = 0
        self._ticking: asyncio.TimerHandle | None = None
        self._again: asyncio.Task[None] | None = None
        self._is_closed = False

    @property
    def pid(self) -> int | None:
        """The process that holds them; None while there is none."""
        return self._process.pid if self._process is not None else None

    @property
    def is_crowded(self) -> bool:
        """Whether much waits for the process."""
        return self._pipe is not None and self._pipe.is_crowded

    async def listen(self, addresses: Sequence[str]) -> tuple[str, ...]:
        """Listen (see `Sockets`)."""
        try:
            if self._pipe is None:
                self._begin()
            self._addresses = await self._listen(addresses)
        except PeerRefused as refused:
            if refused.code == "LINKS_START":
                await self._give_up(0.0)
            raise
        return self._addresses

    def dial(self, key: PeerKey, address: str, receiver: Receiver) -> _FarRoute:
        """Begin one connection; where there is no process, as soon as there is one."""
        route = _FarRoute(self, next(self._numbers), address, key)
        route.receiver = receiver
        self._routes[route.number] = route
        self.tell("dial", route.number, key, address)
        return route

    def set_trust(self, trust: Trust) -> None:
        """Judge by this trust from now on."""
        self._trust = trust
        self._tell_trust()

    async def close(self) -> None:
        """Let go of everything; what was sent last may take a moment to leave."""
        self._is_closed = True
        if self._again is not None:
            self._again.cancel()
            await asyncio.wait({self._again})
        self.tell("close")
        if self._process is not None:
            await self._process.ended(GRACE_S)
        await self._give_up(0.0)

    def tell(self, *fields: Any) -> None:
        """Tell the process something, if there is one."""
        if self._pipe is not None:
            self._pipe.send(*fields)

    def forget(self, number: int) -> None:
        """A connection is over."""
        self._routes.pop(number, None)

    def _begin(self) -> None:
        """Start the process, and tell it what it must know. Raises `PeerRefused` (LINKS_START);
        where there is a process then, it is still to be given up."""
        try:
            self._pipe = self._piped()
        except OSError as error:
            raise _not_started(str(error)) from error
        self._since_s, self._unanswered = self._loop.time(), 0
        self._tell_trust()
        keys = self._me.keys
        self.tell("begin", self._me.name, [keys.public, keys.secret] if keys else None)
        for route in self._routes.values():  # dialled while there was no process
            self.tell("dial", route.number, route.key, route.address)
        self._tick()

    def _piped(self) -> Pipe:
        """Start the process; the pipe to it. Raises `OSError`."""
        ours, theirs = pipe_sockets()
        with theirs, contextlib.ExitStack() as taken:
            taken.callback(ours.close)
            self._process = self._start(theirs)
            pipe = Pipe(ours, self._on_packet, self._on_closed, MOST_WAITING)
            taken.pop_all()
        return pipe

    async def _listen(self, addresses: Sequence[str]) -> tuple[str, ...]:
        self._bound = self._loop.create_future()
        self.tell("listen", list(addresses))
        try:
            async with asyncio.timeout(START_S):
                return await self._bound
        except TimeoutError as error:
            raise _not_started("it does not answer") from error
        finally:
            self._bound = None

    def _tell_trust(self) -> None:
        text = trust_file.to_text(self._trust)
        for at in range(0, len(text), _PIECE):
            self.tell("trust", text[at : at + _PIECE], at + _PIECE >= len(text))

    def _tick(self) -> None:
        """Have the process know that this loop runs, and see whether its own does."""
        self._ticking = self._loop.call_later(BEAT_S, self._tick)
        self._unanswered += 1
        self.tell("tick")
        if self._unanswered > MOST_UNANSWERED:
            self._on_died("does not answer")

    async def _give_up(self, grace_s: float) -> str:
        """End the process, if it does not by itself; how it ended."""
        if self._ticking is not None:
            self._ticking.cancel()
        if self._pipe is not None:
            self._pipe.close()
        process, self._process, self._pipe = self._process, None, None
        return await process.ended(grace_s) if process is not None else ""

    def _on_closed(self, violated: ProtocolViolation | None) -> None:
        self._on_died(f"breaks the protocol ({violated.problems[0].message})" if violated else "")

    def _on_died(self, told: str = "") -> None:
        """The process is gone, or is not what it should be: every connection is over."""
        if self._is_closed or self._pipe is None:
            return
        self._pipe.close()
        self._pipe = None
        routes, self._routes = self._routes, {}
        for route in routes.values():
            route.is_over = True
            route.receiver.over(None)
        if self._bound is not None and not self._bound.done():
            self._bound.set_exception(_not_started("it has ended"))
        elif self._again is None:
            self._again = self._loop.create_task(self._start_again(told))

    async def _start_again(self, told: str) -> None:
        """Say how it ended, and start it until it listens as before."""
        if self._loop.time() - self._since_s > LONGEST_WAIT_S:
            self._wait_s = FIRST_WAIT_S
        ended = await self._give_up(0.0 if told else TOLD_S)
        told = f"the process that holds the links to other hosts {told or ended}: all links broke"
        self._owner.on_failed(Problem("LINKS_DIED", told))
        while self._pipe is None:
            await asyncio.sleep(self._wait_s)
            self._wait_s = min(2 * self._wait_s, LONGEST_WAIT_S)
            try:
                self._begin()
                self._addresses = await self._listen(self._addresses)
            except NondumError as error:
                log.warning("links to other hosts do not come back yet: %s", error)
                await self._give_up(0.0)
        self._again = None

    def _on_packet(self, packet: Any) -> None:
        match packet:
            case ["data", int(number), bytes(data)]:
                if route := self._routes.get(number):
                    route.receiver.received(data)
            case ["tock", int(strangers)]:
                self._unanswered, self.strangers = 0, strangers
            case ["accepted", int(number), str(address), str(proved)]:
                self._accept(number, address, proved)
            case ["refused", str(reason), str(address), str(key), str(told)]:
                now_s = self._loop.time()
                self._owner.on_refusal(Refusal(_reason(reason), address, key, told, now_s))
            case ["listening", list(addresses)] if self._bound is not None:
                if not self._bound.done():
                    self._bound.set_result(tuple(map(str, addresses)))
            case ["unusable", list(problems)] if self._bound is not None and problems:
                if not self._bound.done():
                    self._bound.set_exception(PeerRefused(*map(read_problem, problems)))
            case [str(what), int(number), *more]:
                if route := self._routes.get(number):
                    self._on_news(route, what, more)
            case _:
                raise violation()

    def _accept(self, number: int, address: str, proved: str) -> None:
        has_key = bool(proved) == (self._me.security is Security.CURVE)
        is_new = number % 2 == 0 and number not in self._routes
        if not has_key or not is_new or len(self._routes) >= MOST_CONNECTIONS:
            raise violation()
        route = self._routes[number] = _FarRoute(self, number, address)
        route.receiver = self._owner.on_accepted(route, PeerKey(proved) if proved else None)

    def _on_news(self, route: _FarRoute, what: str, more: list[Any]) -> None:
        """What was told of one connection. Raises `ProtocolViolation`."""
        match what, more:
            case "taken", [int(count)]:
                route.taken(count)
            case "connected", []:
                route.receiver.connected()
            case "misused", [str(reason)]:
                route.receiver.misused(_reason(reason))
            case "doubtful", []:
                route.receiver.doubtful()
            case "over", [problem]:
                route.is_over = True
                self.forget(route.number)
                route.receiver.over(None if problem is None else read_problem(problem))
            case _:
                raise violation()


class _FarRoute:
    """A connection of the process."""

    receiver: Receiver
    """Set before anything is told."""

    def __init__(
        self, apart: SocketProcess, number: int, address: str, key: PeerKey | None = None
    ) -> None:
        """`key` of a dialled one."""
        self.number, self.address, self.key = number, address, key
        self.is_over = False
        self._apart = apart
        self._untaken = 0

    def became_peer(self) -> None:
        """The other end has shown that it is a peer's."""
        self._tell("peer")

    def send(self, data: bytes) -> Sent:
        """Send without waiting: its end may be told later, by the receiver."""
        if self.is_over:
            return Sent.GONE
        if self._untaken >= WINDOW or self._apart.is_crowded:
            return Sent.FULL
        self._untaken += 1
        self._tell("data", data)
        return Sent.SENT

    def drain(self) -> bool:
        """Nothing waits here: what comes is told in its order, the end last."""
        return True

    def cut(self, linger_ms: int = 0) -> None:
        """End the connection."""
        self._tell("cut", linger_ms)
        if self.key is not None:  # nothing more is told of a dialled one
            self.is_over = True
            self._apart.forget(self.number)

    def taken(self, count: int) -> None:
        """The process has passed on `count` messages."""
        self._untaken = max(0, self._untaken - max(0, count))

    def _tell(self, what: str, *more: Any) -> None:
        if not self.is_over:
            self._apart.tell(what, self.number, *more)


def _reason(value: str) -> Reason:
    try:
        return Reason(value)
    except ValueError as error:
        raise violation() from error


def _not_started(why: str) -> PeerRefused:
    told = f"the process of the links to other hosts does not start: {why}"
    return PeerRefused(Problem("LINKS_START", told))
