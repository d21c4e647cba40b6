"""A host's end of all links to other hosts: its sockets, and what can be done with them."""

from __future__ import annotations

import asyncio
import functools
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime

import zmq

from nondum.sdk.errors import Problem
from nondum.sdk.wire import Body
from nondum.sdk.wire_fields import MAX_ID
from nondum.transport.peers.allowance import BARRED_S, USUAL, Allowance
from nondum.transport.peers.arrivals import Arrivals
from nondum.transport.peers.beats import BEAT_S, QUICK_LINKS, beat_s
from nondum.transport.peers.calls import Call
from nondum.transport.peers.dial import Attempt, Dial
from nondum.transport.peers.drained import Drained, Sent
from nondum.transport.peers.errands import Handler
from nondum.transport.peers.events import Loss, PeerEvent
from nondum.transport.peers.failures import PeerRefused, PeerUnreachable
from nondum.transport.peers.gate import Gate, entry
from nondum.transport.peers.identity import Identity, Security
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.link import AcceptedRoute, Link, Route
from nondum.transport.peers.listener import HIGH_WATER, dialling, listening
from nondum.transport.peers.messages import MAX_MESSAGE, Notice, Ping, encode
from nondum.transport.peers.monitor import Watch
from nondum.transport.peers.proof import prove_enforced
from nondum.transport.peers.pulse import Pulse
from nondum.transport.peers.received import MOST_AHEAD
from nondum.transport.peers.refusals import Reason, Refusal, Refusals
from nondum.transport.peers.roster import LINGER_MS, Roster
from nondum.transport.peers.trust import Admission, Trust
from nondum.transport.peers.zap import Entry, Knock, ZapHandler

SECOND_LOOK_S = 0.02
"""ZeroMQ tells of a broken connection a little before sending over it fails."""
LOOK_S = 0.1
"""Time between two looks at what came over the links and is no whole message yet. What comes in
between fills this process's memory. With more than `QUICK_LINKS` links it is longer.
"""
ENDLESS_LINGER_MS = 10
"""How long the last words may take over a link that fills the memory meanwhile."""
_NO_PULSE = Pulse()


def fresh_epoch() -> int:
    """Draw a number that tells this life of a host from its others: no clock is needed to."""
    return 1 + secrets.randbelow(MAX_ID)


class PeerNode:
    """Links to other hosts. `await start(…)` it, and `await close()` it."""

    def __init__(
        self,
        identity: Identity,
        trust: Trust,
        handler: Handler,
        *,
        on_event: Callable[[PeerEvent], None],
        pulse: Pulse = _NO_PULSE,
        epoch: int | None = None,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
        allowance: Allowance = USUAL,
    ) -> None:
        """Made on the running loop. `trust` is not asked in development mode.

        `pulse` is what rides in pings; `epoch` is drawn when it is not given; `clock` tells the
        time of day, which only certificates need; `allowance` is what each peer may send.
        """
        self.identity = identity
        self.epoch = epoch or fresh_epoch()
        """Tells this life of the host from earlier ones."""
        self.expected = 0
        """How many peers it is to have, as far as anybody knows; for how often they are pinged."""
        self.refusals = Refusals(on_event)
        self._gate = Gate(identity, trust, clock)
        self._on_event = on_event
        self._roster = Roster(
            self._gate,
            self.epoch,
            handler,
            self.refusals,
            on_event,
            self._became_peer,
            pulse,
            allowance=allowance,
        )
        self._arrivals = Arrivals(self.refusals, self._on_closed, self._roster.awake_s)
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._loop = asyncio.get_running_loop()
        self._inbound: dict[bytes, Link] = {}
        self._zap: ZapHandler | None = None
        self._listener: Drained | None = None
        self._ears: Watch | None = None
        self._beating: asyncio.TimerHandle | None = None
        self._looking: asyncio.TimerHandle | None = None

    @property
    def security(self) -> Security:
        """How links are secured; to be shown with every status."""
        return self.identity.security

    @property
    def peers(self) -> Mapping[PeerKey, Admission]:
        """Who can be called now."""
        return {key: session.admission for key, session in self._roster.sessions.items()}

    @property
    def strangers(self) -> int:
        """How many connections are not a peer's yet."""
        return self._arrivals.strangers

    @property
    def accepted(self) -> tuple[Route, ...]:
        """The connections that peers made to this host."""
        return tuple(link.route for link in self._roster.links if not link.dialled)

    @property
    def dialled(self) -> tuple[Route, ...]:
        """The connections that this host made to peers."""
        return tuple(link.route for link in self._roster.links if link.dialled)

    def round_trip_s(self, peer: PeerKey) -> float | None:
        """The last ping's time there and back; None before one was answered."""
        session = self._roster.sessions.get(peer)
        return session.links[-1].round_trip_s if session and session.links else None

    async def start(self, addresses: Sequence[str]) -> tuple[str, ...]:
        """Listen at addresses (`tcp://*:0` picks a port); the addresses as bound.

        Raises `PeerRefused` (ZAP_INEFFECTIVE, ZAP_TAKEN, DEVELOPMENT_LOOPBACK, ADDRESS_MALFORMED,
        ADDRESS_UNUSABLE); it may then be tried again. Nothing is bound before the socket has turned
        away a stranger.
        """
        for address in addresses:
            self.identity.check_address(address)
        if self._zap is None:
            self._zap = ZapHandler(self._context, self._judge)
        socket = listening(self._context, self.identity.keys)
        try:
            await prove_enforced(socket, self.identity.keys, self._zap.expect_probe)
            self._ears = Watch(socket, self._arrivals.on_event)
            bound = tuple(_bind(socket, address) for address in addresses)
        except BaseException:
            if self._ears is not None:
                self._ears.close()
            socket.close(0)
            self._ears = None
            raise
        self._listener = Drained(socket, self._on_frames)
        self._beating = self._loop.call_later(BEAT_S, self._beat)
        self._looking = self._loop.call_later(LOOK_S, self._look)
        return bound

    def dial(self, peer: PeerKey, addresses: Sequence[str]) -> None:
        """Be linked to a peer from now on, by whichever of its addresses works first.

        Dialling a peer again exchanges its addresses. Raises `PeerRefused` (DEVELOPMENT_LOOPBACK,
        ADDRESS_MALFORMED).
        """
        for address in addresses:
            self.identity.check_address(address)
        self.hang_up(peer)
        self._roster.dials[peer] = Dial(
            peer,
            addresses,
            connect=lambda key: dialling(self._context, self.identity.keys, key),
            is_wanted=self._roster.is_unlinked,
            on_won=self._on_won,
            on_over=self._on_attempt_over,
            on_data=self._on_dialled,
            on_event=self._on_event,
        )

    def hang_up(self, peer: PeerKey) -> None:
        """Dial a peer no more; a link that exists stays until it breaks."""
        if dial := self._roster.dials.pop(peer, None):
            dial.close()

    def call(self, peer: PeerKey, method: str, args: Body, *, deadline_s: float) -> Call:
        """Call a peer; await the result for the answer, or iterate over its progress.

        Raises `PeerUnreachable` (PEER_DOWN, PEER_BUSY), and `ProtocolViolation` or `TypeError` for
        what cannot be sent.
        """
        return self._roster.session(peer).calls.begin(method, args, deadline_s)

    def notify(self, peer: PeerKey, method: str, args: Body) -> None:
        """Tell a peer something; at most once, and not at all when the link breaks.

        Raises as `call` does.
        """
        if self._roster.session(peer).notify(Notice(method, args)) is Sent.FULL:
            raise PeerUnreachable(Problem("PEER_BUSY", "as many messages wait for it as may"))

    def notify_all(self, method: str, args: Body) -> None:
        """Tell every peer something; those that cannot take it now miss it.

        Raises `ProtocolViolation`, `TypeError` for what cannot be sent.
        """
        data = encode(Notice(method, args))
        for session in list(self._roster.sessions.values()):
            session.send(data)

    def turn_away(self, peer: PeerKey, problem: Problem) -> None:
        """Cut a peer that breaks the rules in what it answers; counted, and it is told why."""
        for link in list(self._roster.session(peer).links):
            self._roster.turn_away(link, Reason.GARBAGE, problem)

    def set_trust(self, trust: Trust) -> None:
        """Exchange the trust: peers that it does not let in any more are cut at once."""
        self._gate.trust = trust
        self._roster.check_trust()

    def show_certificate(self, certificate: bytes) -> None:
        """Show another certificate from now on; links that exist stay as they are."""
        self.identity = replace(self.identity, certificate=certificate)
        self._gate.identity = self.identity

    async def close(self) -> None:
        """Say goodbye and let go of everything; what runs for peers is cancelled."""
        for timer in (self._beating, self._looking):
            if timer is not None:
                timer.cancel()
        self._roster.close()
        if self._ears is not None:
            self._ears.close()
        if self._listener is not None:
            self._listener.close(LINGER_MS)
        if self._zap is not None:
            self._zap.close()
        await asyncio.to_thread(self._context.term)

    def _on_frames(self, frames: list[zmq.Frame]) -> None:
        """A message came to the listening socket."""
        data = frames[-1]
        proved = None
        if self.security is Security.CURVE:
            proved = PeerKey(str(data.get("User-Id")))
        link = self._link(frames[0].bytes, data, proved)
        assert isinstance(link.route, AcceptedRoute)
        link.route.received.delivered(frames[1:])
        if link.proved != proved:
            self._roster.turn_away(link, Reason.NOT_PROVED, _OTHER_KEY)
        elif len(frames) != 2:
            self._roster.turn_away(link, Reason.GARBAGE, _PARTS)
        else:
            self._roster.receive(link, data.bytes)

    def _link(self, routing_id: bytes, data: zmq.Frame, proved: PeerKey | None) -> Link:
        link = self._inbound.get(routing_id)
        if link is None:
            assert self._listener is not None
            descriptor = int(data.get(zmq.SRCFD))
            is_sealed = self.security is Security.CURVE
            route = AcceptedRoute(self._listener, routing_id, descriptor, is_sealed=is_sealed)
            for other in self._inbound.values():
                assert isinstance(other.route, AcceptedRoute)
                other.route.received.yield_to(route.received)
            link = Link(route, proved, self._loop.time(), dialled=False)
            self._inbound[routing_id] = link
            self._arrivals.spoke(route.descriptor)
        return link

    def _on_dialled(self, link: Link, frames: list[zmq.Frame]) -> None:
        """A message came to a socket that this host has dialled with."""
        if len(frames) == 1:
            self._roster.receive(link, frames[0].bytes)
        else:
            self._roster.turn_away(link, Reason.GARBAGE, _PARTS)

    def _on_won(self, attempt: Attempt) -> None:
        proved = attempt.dial.key if self.security is Security.CURVE else None
        attempt.link = Link(attempt, proved, self._loop.time(), dialled=True)
        attempt.link.on_refused = functools.partial(attempt.dial.over, attempt)
        self._roster.greet(attempt.link, attempt.dial.key)

    def _on_attempt_over(self, attempt: Attempt) -> None:
        if attempt.link is not None:
            self._roster.break_link(attempt.link, Loss.DISCONNECTED)

    def _became_peer(self, link: Link) -> None:
        assert isinstance(link.route, AcceptedRoute)
        self._arrivals.became_peer(link.route.descriptor)

    def _judge(self, knock: Knock) -> Entry:
        reason = self._gate.judge(knock)
        if reason is not None:
            now_s, told = self._loop.time(), "turned away at the handshake"
            self.refusals.add(Refusal(reason, knock.address, knock.key, told, now_s))
        return entry(reason)

    def _on_closed(self, descriptor: int) -> None:
        """An accepted connection broke. Its descriptor may have been others' before and since, so
        all links that had it are tried."""
        if self._listener is None or self._listener.is_closed:
            return
        self._listener.drain()  # the goodbye may wait still
        for link in list(self._inbound.values()):
            assert isinstance(link.route, AcceptedRoute)
            if link.route.descriptor == descriptor:
                self._roster.try_link(link)
                self._loop.call_later(SECOND_LOOK_S, self._roster.try_link, link)

    def _beat(self) -> None:
        self._beating = self._loop.call_later(BEAT_S, self._beat)
        self._roster.beat(beat_s(max(len(self._roster.sessions), self.expected)))
        # Links that are over keep their ids until their connections are gone: what was read of
        # them before they were cut must not make a new link.
        for routing_id, link in list(self._inbound.items()):
            if link.is_over and link.route.send(_PING) is Sent.GONE:
                del self._inbound[routing_id]

    def _look(self) -> None:
        """Cut the connections over which a message comes that does not end."""
        links = list(self._roster.links)
        next_s = LOOK_S * max(1.0, len(links) / QUICK_LINKS)
        self._looking = self._loop.call_later(next_s, self._look)
        if self._listener is not None:
            self._listener.drain()  # what makes a connection a peer's may wait to be read
        self._arrivals.cut_overdue()
        for link in links:
            if not link.is_over and self._is_endless(link.route):
                problem = _endless(link)
                self._roster.bar(link, Reason.ENDLESS, problem, linger_ms=ENDLESS_LINGER_MS)
        for link in list(self._inbound.values()):
            if link.is_over and self._is_endless(link.route):
                link.route.cut()  # it has no time for its last words

    def _is_endless(self, route: Route) -> bool:
        assert isinstance(route, AcceptedRoute | Attempt)
        received = route.received
        if received is None:
            return False
        read = received.read()
        if received.ahead(read) <= MOST_AHEAD:
            return False
        # Whole messages may wait to be taken in, but no more than ZeroMQ lets wait.
        may_wait = 0 if route.drain() else HIGH_WATER * MAX_MESSAGE
        return received.ahead(read) > MOST_AHEAD + may_wait


_PING = encode(Ping(1))
_PARTS = Problem("PACKET_KIND", "a message has one part")
_OTHER_KEY = Problem("PEER_NOT_PROVED", "a message came under another key than the link's")


def _endless(link: Link) -> Problem:
    return Problem(
        "PEER_ENDLESS",
        f"it sends a message that does not end, and is not let in for {BARRED_S:.0f} s",
        where=link.session.admission.name if link.session else link.route.address,
        fix="look what runs on that host; if it was taken over, revoke its key",
    )


def _bind(socket: zmq.Socket[bytes], address: str) -> str:
    try:
        socket.bind(f"{address[:-1]}*" if address.endswith(":0") else address)
    except zmq.ZMQError as error:
        told = f"peers cannot be listened for there: {error}"
        raise PeerRefused(Problem("ADDRESS_UNUSABLE", told, where=address)) from error
    bound = socket.getsockopt(zmq.LAST_ENDPOINT)
    assert isinstance(bound, bytes)
    return bound.rstrip(b"\0").decode("ascii").replace("[::ffff:127.0.0.1]", "127.0.0.1")
