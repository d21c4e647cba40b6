"""A host's end of all links: it listens, dials, lets in, and notices who is gone."""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC, datetime

import zmq

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.wire import MAX_ID, Body
from nondum.transport.peers.accepted import AcceptedConnections
from nondum.transport.peers.calls import Call
from nondum.transport.peers.dial import Attempt, Dial
from nondum.transport.peers.drained import Drained, Sent
from nondum.transport.peers.errands import Errand, Handler
from nondum.transport.peers.events import Loss, PeerEvent, PeerLost, PeerUp
from nondum.transport.peers.failures import PeerRefused, PeerUnreachable
from nondum.transport.peers.gate import Acquaintance, Gate, TurnedAway, entry
from nondum.transport.peers.identity import Identity, Security
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.link import AcceptedRoute, Link
from nondum.transport.peers.listener import dialling, listening, prove_enforced
from nondum.transport.peers.messages import (
    VERSIONS,
    Bye,
    Hello,
    Message,
    Notice,
    Ping,
    Refused,
    Welcome,
    agreed_version,
    decode,
    encode,
)
from nondum.transport.peers.monitor import HANDSHAKE_FAILED, SocketEvent, watch
from nondum.transport.peers.refusals import Reason, Refusal, Refusals
from nondum.transport.peers.session import Departed, OutOfPlace, Session
from nondum.transport.peers.trust import Admission, Trust
from nondum.transport.peers.zap import Entry, Knock, ZapHandler

BEAT_S = 0.3
"""Time between two pings."""
SILENCE_S = 1.0
"""A link over which nothing came for so long is dead: three pings were missed."""
RESUME_S = 0.5
"""How long a peer may be without a link before it is lost."""
ACQUAINTANCES = 1024
"""Peers that are remembered while they are away."""
LINGER_MS = 200

log = logging.getLogger(__name__)


class PeerNode:
    """Links to other hosts. `await start(…)` it, and `await close()` it."""

    def __init__(
        self,
        identity: Identity,
        trust: Trust,
        handler: Handler,
        *,
        on_event: Callable[[PeerEvent], None],
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        """`trust` is not asked in development mode. `clock` tells the time of day."""
        self.identity = identity
        self.epoch = 1 + secrets.randbelow(MAX_ID)
        """Tells this life of the host from earlier ones: no clock is needed to."""
        self.refusals = Refusals()
        self._gate = Gate(identity, trust, clock)
        self._handler, self._on_event = handler, on_event
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._sessions: dict[PeerKey, Session] = {}
        self._known: dict[PeerKey, Acquaintance] = {}
        self._dials: dict[PeerKey, Dial] = {}
        self._accepted = AcceptedConnections()
        self._inbound: dict[bytes, Link] = {}
        self._outbound: dict[Attempt, Link] = {}
        self._orphans: set[Errand] = set()
        self._timers: set[asyncio.TimerHandle] = set()
        self._zap: ZapHandler | None = None
        self._listener: Drained | None = None
        self._ears: Drained | None = None
        self._beating: asyncio.TimerHandle | None = None

    @property
    def security(self) -> Security:
        """How links are secured; to be shown with every status."""
        return self.identity.security

    @property
    def peers(self) -> Mapping[PeerKey, Admission]:
        """Who can be called now."""
        return {key: session.admission for key, session in self._sessions.items()}

    def round_trip_s(self, peer: PeerKey) -> float | None:
        """The last ping's time there and back; None before one was answered."""
        session = self._sessions.get(peer)
        return session.links[-1].round_trip_s if session and session.links else None

    async def start(self, addresses: Sequence[str]) -> tuple[str, ...]:
        """Listen at addresses (`tcp://*:0` picks a port); the addresses as bound.

        Raises `PeerRefused` (ZAP_INEFFECTIVE, ZAP_TAKEN, DEVELOPMENT_LOOPBACK, ADDRESS_MALFORMED,
        ADDRESS_UNUSABLE). Nothing is bound before the socket has turned away a stranger.
        """
        for address in addresses:
            self.identity.check_address(address)
        self._zap = ZapHandler(self._context, self._judge)
        socket = listening(self._context, self.identity.keys)
        try:
            await prove_enforced(socket, self.identity.keys, self._zap.expect_probe)
            self._ears = watch(socket, self._on_socket_event)
            bound = tuple(_bind(socket, address) for address in addresses)
        except BaseException:
            if self._ears is not None:
                self._ears.close()
            socket.disable_monitor()
            socket.close(0)
            raise
        self._listener = Drained(socket, self._on_listener)
        self._beating = asyncio.get_running_loop().call_later(BEAT_S, self._beat)
        return bound

    def dial(self, peer: PeerKey, addresses: Sequence[str]) -> None:
        """Be linked to a peer from now on, by whichever of its addresses works first.

        Dialling a peer again exchanges its addresses. Raises `PeerRefused` (DEVELOPMENT_LOOPBACK,
        ADDRESS_MALFORMED).
        """
        for address in addresses:
            self.identity.check_address(address)
        self.hang_up(peer)
        self._dials[peer] = Dial(
            peer,
            addresses,
            connect=lambda key: dialling(self._context, self.identity.keys, key),
            is_wanted=self._is_unlinked,
            on_won=self._on_won,
            on_over=self._on_attempt_over,
            on_data=self._on_dialled,
            on_event=self._on_event,
        )

    def hang_up(self, peer: PeerKey) -> None:
        """Dial a peer no more; a link that exists stays until it breaks."""
        if dial := self._dials.pop(peer, None):
            dial.close()

    def call(self, peer: PeerKey, method: str, args: Body, *, deadline_s: float) -> Call:
        """Call a peer; await the result for the answer, or iterate over its progress.

        Raises `PeerUnreachable` (PEER_DOWN, PEER_BUSY), and `ProtocolViolation` or `TypeError` for
        what cannot be sent.
        """
        return self._session(peer).calls.begin(method, args, deadline_s)

    def notify(self, peer: PeerKey, method: str, args: Body) -> None:
        """Tell a peer something; at most once, and not at all when the link breaks.

        Raises as `call` does.
        """
        if self._session(peer).notify(Notice(method, args)) is Sent.FULL:
            raise PeerUnreachable(Problem("PEER_BUSY", "as many messages wait for the peer as may"))

    def set_trust(self, trust: Trust) -> None:
        """Exchange the trust: peers that it does not let in any more are cut at once."""
        self._gate.trust = trust
        for session in list(self._sessions.values()):
            if not self._gate.still_admits(session.admission):
                self._tell_all(session, Refused(_revoked()))
                self._lose(session, Loss.REVOKED)

    async def close(self) -> None:
        """Say goodbye and let go of everything; what runs for peers is cancelled."""
        for timer in (self._beating, *self._timers):
            if timer is not None:
                timer.cancel()
        for dial in self._dials.values():
            dial.close()
        for session in list(self._sessions.values()):
            self._lose(session, Loss.CLOSED)
        for errand in list(self._orphans):
            errand.halt()
        for link in list(self._outbound.values()):
            link.cut()
        for drained in (self._ears, self._listener):
            if drained is not None:
                drained.close(LINGER_MS)
        if self._zap is not None:
            self._zap.close()
        await asyncio.to_thread(self._context.term)

    # What comes in

    def _on_listener(self, frames: list[zmq.Frame]) -> None:
        data = frames[-1]
        routing_id, descriptor = frames[0].bytes, int(data.get(zmq.SRCFD))
        proved = None
        if self.security is Security.CURVE:
            proved = PeerKey(str(data.get("User-Id")))
        link = self._inbound.get(routing_id)
        if link is None:
            assert self._listener is not None
            route = AcceptedRoute(self._listener, routing_id, descriptor)
            link = Link(route, proved, _now(), dialled=False)
            self._inbound[routing_id] = link
        if len(frames) != 2:
            self._turn_away(link, Reason.GARBAGE, _parts(len(frames)))
        elif link.proved != proved:
            self._turn_away(link, Reason.NOT_PROVED, _other_key())
        else:
            self._receive(link, data.bytes)

    def _on_dialled(self, attempt: Attempt, frames: list[zmq.Frame]) -> None:
        if link := self._outbound.get(attempt):
            if len(frames) == 1:
                self._receive(link, frames[0].bytes)
            else:
                self._turn_away(link, Reason.GARBAGE, _parts(len(frames)))

    def _receive(self, link: Link, data: bytes) -> None:
        now_s, session = _now(), link.session
        if link.is_over:
            return
        if link.proved is not None and self._gate.is_revoked(link.proved):
            self._turn_away(link, Reason.REVOKED, _revoked())
            return
        if session is not None and now_s - link.heard_s > SILENCE_S:
            # This host may have hung itself: what waited meanwhile is from a link that is over.
            self._break(link, Loss.SILENT)
            return
        link.heard_s = now_s
        try:
            message = decode(data)
            if session is not None:
                session.receive(link, message)
            else:
                self._greeted(link, message)
        except ProtocolViolation as violation:
            self._turn_away(link, Reason.GARBAGE, violation.problems[0])
        except OutOfPlace as wrong:
            self._turn_away(link, Reason.GARBAGE, Problem("HANDSHAKE", str(wrong)))
        except TurnedAway as refused:
            self._turn_away(link, refused.reason, refused.problem)
        except Departed as departed:
            assert session is not None
            self._lose(session, departed.reason)

    # Greetings

    def _greeted(self, link: Link, message: Message) -> None:
        """The first message of a link. Raises `TurnedAway`, `OutOfPlace`."""
        match message:
            case Hello() if not link.dialled:
                admission = self._gate.admit(message, link.proved)
                known = self._acquaintance(admission.key)
                self._meet(known, message, admission)
                link.tell(Welcome(self._hello(known, agreed_version(message))))
                assert isinstance(link.route, AcceptedRoute)
                self._accepted.became_peer(link.route.descriptor, _now())
            case Welcome(hello) if link.dialled:
                admission = self._gate.admit(hello, link.proved)
                known = self._acquaintance(admission.key)
                self._meet(known, hello, admission)
            case Refused(problem) if link.dialled:
                self._dial_refused(link, problem)
                return
            case _:
                raise OutOfPlace("a link begins with a greeting")
        self._join(link, admission, known)

    def _meet(self, known: Acquaintance, hello: Hello, admission: Admission) -> None:
        """End what was there before, if the greeting begins something new."""
        former = known.epoch
        if known.meet(hello) and (session := self._sessions.get(admission.key)):
            is_restart = former != hello.epoch
            self._lose(session, Loss.RESTARTED if is_restart else Loss.GAVE_UP)

    def _join(self, link: Link, admission: Admission, known: Acquaintance) -> None:
        session = self._sessions.get(admission.key)
        is_new = session is None
        if session is None:
            session = Session(admission, known, self._handler)
            self._sessions[admission.key] = session
        for replaced in session.join(link):
            self._forget(replaced)
        if dial := self._dials.get(admission.key):
            dial.settled()
        if is_new:
            self._on_event(
                PeerUp(admission.key, admission.name, known.epoch, link.route.address, admission.by)
            )

    def _hello(self, known: Acquaintance, version: int | None = None) -> Hello:
        me = self.identity
        versions = VERSIONS if version is None else (version,)
        return Hello(versions, me.name, me.key, self.epoch, known.term, me.certificate)

    def _acquaintance(self, key: PeerKey) -> Acquaintance:
        if key not in self._known and len(self._known) >= ACQUAINTANCES:
            away = next((one for one in self._known if one not in self._sessions), None)
            if away is not None:
                del self._known[away]
        return self._known.setdefault(key, Acquaintance())

    # Dialling

    def _is_unlinked(self, peer: PeerKey) -> bool:
        session = self._sessions.get(peer)
        return session is None or not session.links

    def _on_won(self, attempt: Attempt) -> None:
        proved = attempt.dial.key if self.security is Security.CURVE else None
        link = Link(attempt.route, proved, _now(), dialled=True)
        self._outbound[attempt] = link
        link.tell(self._hello(self._acquaintance(attempt.dial.key)))

    def _on_attempt_over(self, attempt: Attempt) -> None:
        if link := self._outbound.pop(attempt, None):
            self._break(link, Loss.DISCONNECTED)

    def _dial_refused(self, link: Link, problem: Problem) -> None:
        for attempt, one in list(self._outbound.items()):
            if one is link:
                attempt.dial.over(attempt, problem)

    # Losing

    def _break(self, link: Link, reason: Loss) -> None:
        """A link is over: the session waits for another, unless the link fell silent."""
        session = link.session
        self._forget(link)
        if session is None or session.leave(link) or session.missing is not None:
            return
        if self._sessions.get(session.admission.key) is not session:
            return
        if reason is Loss.SILENT:
            self._lose(session, reason)
            return
        session.missing = asyncio.get_running_loop().call_later(
            RESUME_S, self._lose, session, reason
        )
        if dial := self._dials.get(session.admission.key):
            dial.again()

    def _lose(self, session: Session, reason: Loss) -> None:
        """The peer is lost: end what was between the hosts, on every link."""
        key = session.admission.key
        if self._sessions.get(key) is not session:
            return
        del self._sessions[key]
        if reason in _OURS:
            session.known.term += 1
        if reason is Loss.CLOSED:
            self._tell_all(session, Bye("closed"))
        for link in session.links:
            self._forget(link, LINGER_MS)
        for errand in session.end(reason):
            self._keep(errand)
        self._on_event(PeerLost(key, session.admission.name, reason))
        if dial := self._dials.get(key):
            dial.again()

    def _keep(self, errand: Errand) -> None:
        """Remember an errand that outlives its caller, until it ends."""
        assert errand.task is not None
        self._orphans.add(errand)
        errand.task.add_done_callback(lambda _: self._orphans.discard(errand))

    def _forget(self, link: Link, linger_ms: int = 0) -> None:
        """End a link's connection."""
        link.cut(linger_ms)
        for attempt, one in list(self._outbound.items()):
            if one is link:
                del self._outbound[attempt]
                attempt.dial.over(attempt, None)

    def _turn_away(self, link: Link, reason: Reason, problem: Problem) -> None:
        """Cut a link for what came over it, tell the other end why, and count it."""
        self._count(reason, link.route.address, link.proved or "", str(problem))
        link.tell(Refused(problem))
        if link.session is not None:
            is_trust = reason is Reason.REVOKED
            self._lose(link.session, Loss.REVOKED if is_trust else Loss.VIOLATED)
        self._forget(link, LINGER_MS)

    def _tell_all(self, session: Session, message: Message) -> None:
        for link in session.links:
            link.tell(message)

    def _count(self, reason: Reason, address: str, key: str, told: str) -> None:
        self.refusals.add(Refusal(reason, address, key, told, _now()))

    # What the sockets tell

    def _judge(self, knock: Knock) -> Entry:
        reason = self._gate.judge(knock)
        if reason is not None:
            self._count(reason, knock.address, knock.key, "turned away at the handshake")
        return entry(reason)

    def _on_socket_event(self, event: SocketEvent) -> None:
        if event.kind == zmq.EVENT_ACCEPTED:
            self._count_all(Reason.CROWDED, self._accepted.opened(event.value, _now()))
        elif event.kind == zmq.EVENT_DISCONNECTED:
            self._accepted.closed(event.value)
            self._look_after(event.value)
        elif event.kind & HANDSHAKE_FAILED and event.kind != zmq.EVENT_HANDSHAKE_FAILED_AUTH:
            reason = Reason.MISMATCH if event.value in _OTHER_KEYS else Reason.GARBAGE
            self._count(reason, "", "", f"the handshake broke off: 0x{event.value:x}")

    def _count_all(self, reason: Reason, ends: Iterable[str]) -> None:
        for end in ends:
            self._count(reason, end, "", reason.value)

    def _look_after(self, descriptor: int) -> None:
        """A connection with this descriptor broke: see whose.

        The descriptor may have been another's since, so the links that had it are tried.
        """
        if self._listener is not None:
            self._listener.drain()
        for link in list(self._inbound.values()):
            assert isinstance(link.route, AcceptedRoute)
            if link.route.descriptor == descriptor:
                self._try_link(link)
                later = asyncio.get_running_loop().call_later(0.02, self._try_link, link)
                self._timers = {t for t in self._timers if not t.cancelled()} | {later}

    def _try_link(self, link: Link) -> None:
        if not link.is_over and link.ping(_now()) is Sent.GONE:
            self._break(link, Loss.DISCONNECTED)

    # Time

    def _beat(self) -> None:
        loop = asyncio.get_running_loop()
        self._beating = loop.call_later(BEAT_S, self._beat)
        now_s = loop.time()
        for session in list(self._sessions.values()):
            self._beat_session(session, now_s)
        self._count_all(Reason.SILENT, self._accepted.cut_overdue(now_s))
        self._sweep()

    def _sweep(self) -> None:
        """Forget the accepted links that are over and gone; until then they keep their ids, so that
        what was read of them before they were cut finds no new link."""
        for routing_id, link in list(self._inbound.items()):
            if link.is_over and link.route.send(_PING) is Sent.GONE:
                del self._inbound[routing_id]

    def _beat_session(self, session: Session, now_s: float) -> None:
        if self._gate.has_expired(session.admission):
            self._lose(session, Loss.EXPIRED)
            return
        session.errands.pass_on_waiting()
        for link in list(session.links):
            if now_s - link.heard_s > SILENCE_S:
                self._break(link, Loss.SILENT)
            elif link.ping(now_s) is Sent.GONE:
                self._break(link, Loss.DISCONNECTED)

    def _session(self, peer: PeerKey) -> Session:
        session = self._sessions.get(peer)
        if session is None:
            raise PeerUnreachable(Problem("PEER_DOWN", "there is no link to the peer", where=peer))
        return session


_OURS = frozenset({Loss.SILENT, Loss.DISCONNECTED, Loss.VIOLATED, Loss.REVOKED, Loss.EXPIRED})
"""Losses that this host has found: the peer may not know that what was between them is over."""
_OTHER_KEYS = frozenset({0x11000001, 0x11000002})
"""ZMQ_PROTOCOL_ERROR_ZMTP_CRYPTOGRAPHIC and …_MECHANISM_MISMATCH: see zmq_socket_monitor(3)."""


_PING = encode(Ping(1))


def _now() -> float:
    return asyncio.get_running_loop().time()


def _bind(socket: zmq.Socket[bytes], address: str) -> str:
    try:
        socket.bind(f"{address[:-1]}*" if address.endswith(":0") else address)
    except zmq.ZMQError as error:
        raise PeerRefused(
            Problem("ADDRESS_UNUSABLE", f"peers cannot be listened for there: {error}", address)
        ) from error
    bound = socket.getsockopt(zmq.LAST_ENDPOINT)
    assert isinstance(bound, bytes)
    return bound.rstrip(b"\0").decode("ascii").replace("[::ffff:127.0.0.1]", "127.0.0.1")


def _parts(count: int) -> Problem:
    return Problem("PACKET_KIND", f"a message has one part, found {count - 1}")


def _other_key() -> Problem:
    return Problem("PEER_NOT_PROVED", "a message came under another key than the link's")


def _revoked() -> Problem:
    return Problem("KEY_REVOKED", "this key was revoked")
