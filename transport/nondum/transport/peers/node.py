"""A host's end of all links to other hosts, and what can be done with them."""

from __future__ import annotations

import asyncio
import functools
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime

from nondum.sdk.errors import Problem
from nondum.sdk.wire import Body
from nondum.sdk.wire_fields import MAX_ID
from nondum.transport.peers.allowance import BARRED_S, USUAL, Allowance
from nondum.transport.peers.calls import Call
from nondum.transport.peers.dial import Attempt, Dial
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.events import LinksFailed, Loss, PeerEvent
from nondum.transport.peers.failures import PeerUnreachable
from nondum.transport.peers.gate import Gate
from nondum.transport.peers.heartbeat import BEAT_S, beat_s
from nondum.transport.peers.identity import Identity, Security
from nondum.transport.peers.incoming_calls import Handler
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.link import Link, Route
from nondum.transport.peers.local_sockets import LocalSockets
from nondum.transport.peers.messages import Notice, encode
from nondum.transport.peers.peer_table import PeerTable
from nondum.transport.peers.pulse import Pulse
from nondum.transport.peers.refusals import Reason, Refusals
from nondum.transport.peers.sockets import Accepted, MakeSockets, Owner, Receiver
from nondum.transport.peers.trust import Admission, Trust

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
        sockets: MakeSockets = LocalSockets,
    ) -> None:
        """Made on the running loop. `trust` is not asked in development mode.

        `pulse` is what rides in pings; `epoch` is drawn when it is not given; `clock` tells the
        time of day, which only certificates need; `allowance` is what each peer may send; `sockets`
        makes what its links go over.
        """
        self.identity = identity
        self.epoch = epoch or fresh_epoch()
        """Tells this life of the host from earlier ones."""
        self.expected = 0
        """How many peers it is expected to have; sets how often they are pinged."""
        self.refusals = Refusals(on_event)
        self._gate = Gate(identity, trust, clock)
        self._on_event = on_event
        self._peer_table = PeerTable(
            *(self._gate, self.epoch, handler, self.refusals, on_event, pulse), allowance=allowance
        )
        owner = Owner(
            self._on_accepted,
            self.refusals.add,
            lambda problem: on_event(LinksFailed(problem)),
            self._peer_table.awake_s,
        )
        self._sockets = sockets(identity, trust, owner)
        self._loop = asyncio.get_running_loop()
        self._beating: asyncio.TimerHandle | None = None

    @property
    def security(self) -> Security:
        """How links are secured; to be shown with every status."""
        return self.identity.security

    @property
    def peers(self) -> Mapping[PeerKey, Admission]:
        """The peers that can be called now."""
        return {key: session.admission for key, session in self._peer_table.sessions.items()}

    @property
    def links_pid(self) -> int | None:
        """The process that holds the sockets of its links; None while there is none."""
        return self._sockets.pid

    @property
    def strangers(self) -> int:
        """How many connections are not a peer's yet."""
        return self._sockets.strangers

    @property
    def accepted(self) -> tuple[Route, ...]:
        """The connections that peers made to this host."""
        return tuple(link.route for link in self._peer_table.links if not link.dialled)

    @property
    def dialled(self) -> tuple[Route, ...]:
        """The connections that this host made to peers."""
        return tuple(link.route for link in self._peer_table.links if link.dialled)

    def round_trip_s(self, peer: PeerKey) -> float | None:
        """The last ping's time there and back; None before one was answered."""
        session = self._peer_table.sessions.get(peer)
        return session.links[-1].round_trip_s if session and session.links else None

    async def start(self, addresses: Sequence[str]) -> tuple[str, ...]:
        """Listen at addresses (`tcp://*:0` picks a port); the addresses as bound.

        Raises `PeerRefused` (ZAP_INEFFECTIVE, ZAP_TAKEN, DEVELOPMENT_LOOPBACK, ADDRESS_MALFORMED,
        ADDRESS_UNUSABLE, LINKS_START); it may then be tried again. Nothing is bound before the
        socket has turned away a stranger.
        """
        for address in addresses:
            self.identity.check_address(address)
        bound = await self._sockets.listen(addresses)
        self._beating = self._loop.call_later(BEAT_S, self._beat)
        return bound

    def dial(self, peer: PeerKey, addresses: Sequence[str]) -> None:
        """Be linked to a peer from now on, by whichever of its addresses works first.

        Dialling a peer again exchanges its addresses. Raises `PeerRefused` (DEVELOPMENT_LOOPBACK,
        ADDRESS_MALFORMED).
        """
        for address in addresses:
            self.identity.check_address(address)
        self.hang_up(peer)
        self._peer_table.dials[peer] = Dial(
            peer,
            addresses,
            connect=self._sockets.dial,
            is_wanted=self._peer_table.is_unlinked,
            on_won=self._on_won,
            on_over=self._on_attempt_over,
            on_data=self._peer_table.receive,
            on_misused=self._on_misused,
            on_event=self._on_event,
        )

    def hang_up(self, peer: PeerKey) -> None:
        """Dial a peer no more; a link that exists stays until it breaks."""
        if dial := self._peer_table.dials.pop(peer, None):
            dial.close()

    def call(self, peer: PeerKey, method: str, args: Body, *, deadline_s: float) -> Call:
        """Call a peer; await the result for the answer, or iterate over its progress.

        Raises `PeerUnreachable` (PEER_DOWN, PEER_BUSY), and `ProtocolViolation` or `TypeError` for
        what cannot be sent.
        """
        return self._peer_table.session(peer).calls.begin(method, args, deadline_s)

    def notify(self, peer: PeerKey, method: str, args: Body) -> None:
        """Tell a peer something; at most once, and not at all when the link breaks.

        Raises as `call` does.
        """
        if self._peer_table.session(peer).notify(Notice(method, args)) is Sent.FULL:
            raise PeerUnreachable(Problem("PEER_BUSY", "as many messages wait for it as may"))

    def notify_all(self, method: str, args: Body) -> None:
        """Tell every peer something; those that cannot take it now miss it.

        Raises `ProtocolViolation`, `TypeError` for what cannot be sent.
        """
        data = encode(Notice(method, args))
        for session in list(self._peer_table.sessions.values()):
            session.send(data)

    def turn_away(self, peer: PeerKey, problem: Problem) -> None:
        """Cut a peer that breaks the rules in what it answers; counted, and it is told why."""
        for link in list(self._peer_table.session(peer).links):
            self._peer_table.turn_away(link, Reason.GARBAGE, problem)

    def set_trust(self, trust: Trust) -> None:
        """Exchange the trust: peers that it does not let in any more are cut at once."""
        self._gate.trust = trust
        self._sockets.set_trust(trust)
        self._peer_table.check_trust()

    def show_certificate(self, certificate: bytes) -> None:
        """Show another certificate from now on; links that exist stay as they are."""
        self.identity = replace(self.identity, certificate=certificate)
        self._gate.identity = self.identity

    async def close(self) -> None:
        """Say goodbye and let go of everything; what runs for peers is cancelled."""
        if self._beating is not None:
            self._beating.cancel()
        self._peer_table.close()
        await self._sockets.close()

    def _on_accepted(self, route: Accepted, proved: PeerKey | None) -> Receiver:
        link = Link(route, proved, self._loop.time(), dialled=False)
        link.on_peer = route.became_peer
        return _AcceptedLink(link, self._peer_table, self._on_misused)

    def _on_misused(self, link: Link, reason: Reason) -> None:
        """What came over a link is no message of a host's."""
        match reason:
            case Reason.ENDLESS:
                self._peer_table.bar(link, reason, _endless(link), linger_ms=ENDLESS_LINGER_MS)
            case Reason.NOT_PROVED:
                self._peer_table.turn_away(link, reason, _OTHER_KEY)
            case _:
                self._peer_table.turn_away(link, reason, _PARTS)

    def _on_won(self, attempt: Attempt) -> None:
        proved = attempt.dial.key if self.security is Security.CURVE else None
        attempt.link = Link(attempt, proved, self._loop.time(), dialled=True)
        attempt.link.on_refused = functools.partial(attempt.dial.over, attempt)
        self._peer_table.greet(attempt.link, attempt.dial.key)

    def _on_attempt_over(self, attempt: Attempt) -> None:
        if attempt.link is not None:
            self._peer_table.break_link(attempt.link, Loss.DISCONNECTED)

    def _beat(self) -> None:
        self._beating = self._loop.call_later(BEAT_S, self._beat)
        self._peer_table.beat(beat_s(max(len(self._peer_table.sessions), self.expected)))


class _AcceptedLink:
    """The receiver of events of a connection that another host made (see `Receiver`)."""

    def __init__(
        self, link: Link, peer_table: PeerTable, on_misused: Callable[[Link, Reason], None]
    ) -> None:
        self._link, self._peer_table, self._on_misused = link, peer_table, on_misused

    def connected(self) -> None:
        """It begins so."""

    def received(self, data: bytes) -> None:
        """A message came."""
        self._peer_table.receive(self._link, data)

    def misused(self, reason: Reason) -> None:
        """What came is no message of a host's."""
        self._on_misused(self._link, reason)

    def doubtful(self) -> None:
        """Its connection may be over."""
        self._peer_table.try_link(self._link)

    def over(self, _problem: Problem | None) -> None:
        """Its connection is over."""
        self._peer_table.break_link(self._link, Loss.DISCONNECTED)


_PARTS = Problem("PACKET_KIND", "a message has one part")
_OTHER_KEY = Problem("PEER_NOT_PROVED", "a message came under another key than the link's")


def _endless(link: Link) -> Problem:
    return Problem(
        "PEER_ENDLESS",
        f"it sends a message that does not end, and is not let in for {BARRED_S:.0f} s",
        where=link.session.admission.name if link.session else link.route.address,
        fix="look what runs on that host; if it was taken over, revoke its key",
    )
