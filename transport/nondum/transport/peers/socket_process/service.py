"""The end of the socket process: its sockets serve the daemon at the other end of the pipe."""

from __future__ import annotations

import asyncio
import itertools
import socket
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from nondum.sdk.errors import Problem
from nondum.transport.peers import trust_file
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.identity import Identity
from nondum.transport.peers.keys import HostKeys, PeerKey
from nondum.transport.peers.link import Route
from nondum.transport.peers.local_sockets import LocalSockets
from nondum.transport.peers.presence import TICKS_AWAKE
from nondum.transport.peers.refusals import Reason, Refusal
from nondum.transport.peers.socket_process.pipe import WINDOW, Pipe, violation
from nondum.transport.peers.sockets import Accepted, Owner
from nondum.transport.peers.suspicion import Awake, Terms
from nondum.transport.peers.trust import Trust

MOST_WAITING = 1024 * 1024
"""Bytes that wait for the daemon; nothing more is read of others then."""
RETRY_S = 0.01
"""Between two attempts to hand on what a peer does not read: ZeroMQ does not tell when it may."""


class Service:
    """One life of the process."""

    def __init__(self, sock: socket.socket) -> None:
        """Own `sock`, the pipe to the daemon. Made on the running loop."""
        self._loop = asyncio.get_running_loop()
        self._here: LocalSockets | None = None
        self._served: dict[int, _Served] = {}
        self._numbers = itertools.count(2, 2)
        self._trust = Trust()
        self._pieces: list[str] = []
        self._awake = Awake(self._loop.time(), TICKS_AWAKE * Terms().tick_s)
        self._retry: asyncio.TimerHandle | None = None
        self._listening: asyncio.Task[None] | None = None
        self._is_asked_to_end: asyncio.Future[bool] = self._loop.create_future()
        self._owner = Owner(
            self._on_accepted,
            self._on_refusal,
            lambda _problem: None,  # where these fail, this process ends
            lambda: self._awake.read(self._loop.time()),
        )
        self._pipe = Pipe(
            sock,
            self._on_packet,
            lambda _: self._end(is_asked=False),
            MOST_WAITING,
            self._on_drained,
        )

    async def run(self) -> None:
        """Serve until the daemon says that it is enough, or is gone."""
        if await self._is_asked_to_end and self._here is not None:
            await self._here.close()

    def _end(self, *, is_asked: bool) -> None:
        if not self._is_asked_to_end.done():
            self._is_asked_to_end.set_result(is_asked)

    def _on_packet(self, packet: Any) -> None:
        match packet:
            case ["data", int(number), bytes(data)]:
                if served := self._served.get(number):
                    served.send(data)
            case ["tick"]:
                self._awake = self._awake.look(self._loop.time())
                self._pipe.send("tock", self._here.strangers if self._here else 0)
            case ["cut", int(number), int(linger_ms)]:
                self._cut(number, linger_ms)
            case ["peer", int(number)]:
                if (served := self._served.get(number)) and served.on_peer is not None:
                    served.on_peer()
            case ["dial", int(number), str(key), str(address)]:
                self._dial(number, PeerKey(key), address)
            case ["trust", str(piece), bool(is_last)]:
                self._learn(piece, is_last=is_last)
            case ["listen", list(addresses)]:
                self._listening = self._loop.create_task(self._listen(addresses))
            case ["begin", str(name), keys]:
                me = Identity(name, HostKeys(PeerKey(keys[0]), keys[1]) if keys else None)
                self._here = LocalSockets(me, self._trust, self._owner)
            case ["close"]:
                self._end(is_asked=True)
            case _:
                raise violation()

    def _learn(self, piece: str, *, is_last: bool) -> None:
        """Take in a piece of the trust, which holds from the last one on."""
        self._pieces.append(piece)
        if is_last:
            self._trust = trust_file.parse("".join(self._pieces))
            self._pieces.clear()
            if self._here is not None:
                self._here.set_trust(self._trust)

    async def _listen(self, addresses: Sequence[str]) -> None:
        assert self._here is not None
        try:
            self._pipe.send("listening", await self._here.listen(addresses))
        except PeerRefused as refused:
            self._pipe.send("unusable", [problem.to_dict() for problem in refused.problems])

    def _dial(self, number: int, key: PeerKey, address: str) -> None:
        assert self._here is not None
        served = _Served(self, number)
        try:
            served.route = self._here.dial(key, address, served)
        except PeerRefused as refused:
            served.over(refused.problems[0])
        else:
            self._served[number] = served

    def _cut(self, number: int, linger_ms: int) -> None:
        served = self._served.get(number)
        if served is None:
            return
        served.route.cut(linger_ms)
        if number % 2:  # nothing more is told of a dialled one
            self.forget(number)

    def _on_accepted(self, route: Accepted, proved: PeerKey | None) -> _Served:
        number = next(self._numbers)
        served = self._served[number] = _Served(self, number)
        served.route, served.on_peer = route, route.became_peer
        self.tell("accepted", number, route.address, proved or "")
        return served

    def _on_refusal(self, refusal: Refusal) -> None:
        self.tell("refused", refusal.reason.value, refusal.address, refusal.key, refusal.told)

    def tell(self, *fields: Any) -> None:
        """Tell the daemon something; where it does not keep up, nothing more is read."""
        self._pipe.send(*fields)
        if self._pipe.is_crowded and self._here is not None:
            self._here.hold()

    def _on_drained(self) -> None:
        if self._here is not None:
            self._here.release()

    def forget(self, number: int) -> None:
        """Nothing more is told of this connection."""
        self._served.pop(number, None)

    def retry_soon(self) -> None:
        """Something could not be handed to ZeroMQ."""
        if self._retry is None:
            self._retry = self._loop.call_later(RETRY_S, self._hand_on)

    def _hand_on(self) -> None:
        self._retry = None
        for served in list(self._served.values()):
            served.hand_on()


class _Served:
    """One connection: what is told of it is told the daemon (see `Receiver`)."""

    route: Route
    """Set before anything is told."""

    def __init__(self, service: Service, number: int) -> None:
        self.on_peer: Callable[[], None] | None = None
        """Called when it is a peer's."""
        self._service, self._number = service, number
        self._waiting: deque[bytes] = deque()
        self._taken = 0
        self._is_over = False

    def connected(self) -> None:
        """The other end has proved its key."""
        self._service.tell("connected", self._number)

    def received(self, data: bytes) -> None:
        """A message came."""
        self._service.tell("data", self._number, data)

    def misused(self, reason: Reason) -> None:
        """What came is no message of a host's."""
        self._service.tell("misused", self._number, reason.value)

    def doubtful(self) -> None:
        """It may be over."""
        self._service.tell("doubtful", self._number)

    def over(self, problem: Problem | None) -> None:
        """It is over."""
        if self._is_over:
            return
        self._is_over = True
        self._service.forget(self._number)
        self._service.tell("over", self._number, problem and problem.to_dict())

    def send(self, data: bytes) -> None:
        """Hand a message on, as soon as ZeroMQ takes it."""
        self._waiting.append(data)
        self.hand_on()

    def hand_on(self) -> None:
        """Hand on what waits."""
        while self._waiting and not self._is_over:
            sent = self.route.send(self._waiting[0])
            is_unread = sent is Sent.GONE and not self.route.drain()
            if sent is Sent.FULL or is_unread:  # what was said last is told before the end
                self._service.retry_soon()
                break
            self._waiting.popleft()
            self._taken += 1
            if sent is Sent.GONE:
                self.route.cut()
                self.over(None)
                return
        if self._taken >= WINDOW // 4:
            self._service.tell("taken", self._number, self._taken)
            self._taken = 0
