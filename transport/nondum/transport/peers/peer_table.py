"""The table of linked peers: greetings make sessions, breaks and silence end them. No sockets."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Mapping

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.transport.peers.allowance import BARRED_S, USUAL, Allowance, cost
from nondum.transport.peers.dial import Dial
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.events import Loss, PeerEvent, PeerLost, PeerUp
from nondum.transport.peers.failures import PeerUnreachable
from nondum.transport.peers.gate import Acquaintance, Gate, TurnedAway
from nondum.transport.peers.incoming_calls import Handler, IncomingCall
from nondum.transport.peers.keys import PeerKey, fingerprint
from nondum.transport.peers.link import LINGER_MS, Link
from nondum.transport.peers.messages import (
    VERSIONS,
    Bye,
    Hello,
    Message,
    Ping,
    Refused,
    Welcome,
    agreed_version,
    decode,
    encode,
    milliseconds,
)
from nondum.transport.peers.presence import Presence
from nondum.transport.peers.pulse import Pulse
from nondum.transport.peers.refusals import Reason, Refusal, Refusals
from nondum.transport.peers.session import Departed, OutOfPlace, Session
from nondum.transport.peers.suspicion import Terms
from nondum.transport.peers.trust import Admission

ACQUAINTANCES = 1024
"""Peers that are remembered while they are away."""

_TERMS = Terms()
UNREAD_S = 0.02
"""Until it is looked again whether all is read that came over a connection that is gone."""


class PeerTable:
    """The sessions of one host, and the wishes to dial."""

    def __init__(
        self,
        gate: Gate,
        epoch: int,
        handler: Handler,
        refusals: Refusals,
        on_event: Callable[[PeerEvent], None],
        pulse: Pulse,
        terms: Terms = _TERMS,
        allowance: Allowance = USUAL,
    ) -> None:
        """`terms` say when a link is dead; `allowance` is every peer's."""
        self.gate, self.epoch = gate, epoch
        self.dials: dict[PeerKey, Dial] = {}
        self._allowance = allowance
        self._handler, self._refusals = handler, refusals
        self._on_event, self._pulse = on_event, pulse
        self._sessions: dict[PeerKey, Session] = {}
        self._known: dict[PeerKey, Acquaintance] = {}
        self._orphans: set[IncomingCall] = set()
        self._loop = asyncio.get_running_loop()
        self._beats, self._beat_s = 1, 0.0
        self._ping = encode(Ping(self._beats))
        """The same for every link, so made once a tick."""
        self._presence = Presence(terms, self._sessions, self._probe, self._on_dead)

    @property
    def sessions(self) -> Mapping[PeerKey, Session]:
        """Of the peers that can be called now."""
        return self._sessions

    def awake_s(self) -> float:
        """How long this host's loop has run; it does not count time in which it stood still."""
        return self._presence.awake_s()

    @property
    def links(self) -> Iterator[Link]:
        """To peers, and those that this host has dialled and that are not a peer's yet."""
        for session in self._sessions.values():
            yield from session.links
        for dial in self.dials.values():
            yield from (link for link in dial.links if link.session is None)

    def session(self, peer: PeerKey) -> Session:
        """A live peer's. Raises `PeerUnreachable` (PEER_DOWN)."""
        session = self._sessions.get(peer)
        if session is None:
            raise PeerUnreachable(Problem("PEER_DOWN", "there is no link to the peer", where=peer))
        return session

    def is_unlinked(self, peer: PeerKey) -> bool:
        """Whether a link to the peer is wanting."""
        session = self._sessions.get(peer)
        return session is None or not session.links

    def greet(self, link: Link, peer: PeerKey) -> None:
        """Begin a link that this host has dialled."""
        link.tell(self._hello(self._acquaintance(peer)))

    def receive(self, link: Link, data: bytes) -> None:
        """Take in what came over a link. Nothing is raised: who breaks the rules is turned away."""
        if link.is_over:
            return
        if link.proved is not None and self.gate.is_revoked(link.proved):
            self.turn_away(link, Reason.REVOKED, _REVOKED)
            return
        now_s, session = self._loop.time(), link.session
        link.heard_s = now_s
        if session is not None:
            self._presence.received(link)
            if link.is_doubtful(now_s):
                self._presence.doubt(session)
        try:
            message = decode(data)
        except ProtocolViolation as violation:
            self.turn_away(link, Reason.GARBAGE, violation.problems[0])
            return
        if session is None or session.is_free(message):
            self._take_in((link, message))
        elif not session.paced.take(
            (link, message), cost(len(data)), passes_held=isinstance(message, Ping)
        ):
            self.bar(link, Reason.FLOODING, _FLOODING)

    def _take_in(self, come: tuple[Link, Message]) -> None:
        link, message = come
        session = link.session
        if link.is_over:
            return
        try:
            if session is not None:
                self._presence.take_in(session, link, message)
                session.receive(link, message)
            else:
                self._greeted(link, message)
        except ProtocolViolation as violation:
            self.turn_away(link, Reason.GARBAGE, violation.problems[0])
        except OutOfPlace as wrong:
            self.turn_away(link, Reason.GARBAGE, Problem("HANDSHAKE", str(wrong)))
        except TurnedAway as refused:
            self.turn_away(link, refused.reason, refused.problem)
        except Departed as departed:
            assert session is not None
            self.lose(session, departed.reason)

    def bar(
        self, link: Link, reason: Reason, problem: Problem, *, linger_ms: int = LINGER_MS
    ) -> None:
        """Cut a link over which far too much comes, and do not let the peer in for a while."""
        if link.session is not None:
            self._bar(link.session.known)
        self.turn_away(link, reason, problem, linger_ms=linger_ms)

    def turn_away(
        self, link: Link, reason: Reason, problem: Problem, *, linger_ms: int = LINGER_MS
    ) -> None:
        """Cut a link for what came over it, tell the other end why, and count it."""
        key, told = link.proved or "", str(problem)
        now_s = self._loop.time()
        self._refusals.add(Refusal(reason, link.route.address, key, told, now_s, problem))
        link.tell(Refused(problem))
        if link.session is not None:
            is_trust = reason is Reason.REVOKED
            loss = Loss.REVOKED if is_trust else Loss.VIOLATED
            self.lose(link.session, loss, linger_ms=linger_ms)
        link.cut(linger_ms)

    def break_link(self, link: Link, reason: Loss) -> None:
        """A link is over: the session waits for another, unless the link fell silent."""
        if link.is_over:
            return
        session = link.session
        link.cut()
        if session is None or session.leave(link) or session.missing is not None:
            return
        key = session.admission.key
        if self._sessions.get(key) is not session:
            return
        if reason is Loss.SILENT:
            self.lose(session, reason)
            return
        wait_s = self._presence.terms.resume_s(self._beat_s)
        session.missing = self._loop.call_later(wait_s, self.lose, session, reason)
        if dial := self.dials.get(key):
            dial.again()

    def lose(self, session: Session, reason: Loss, *, linger_ms: int = LINGER_MS) -> None:
        """The peer is lost: end what was between the hosts, on every link."""
        key = session.admission.key
        if self._sessions.get(key) is not session:
            return
        del self._sessions[key]
        if reason in _OURS:
            session.known.term += 1
        for link in list(session.links):
            link.cut(linger_ms)
        for incoming in session.end(reason):
            self._keep(incoming)
        self._on_event(PeerLost(key, session.admission.name, reason))
        if dial := self.dials.get(key):
            dial.again()

    def check_trust(self) -> None:
        """Cut the peers that the gate does not let in any more."""
        for session in list(self._sessions.values()):
            if not self.gate.still_admits(session.admission):
                self._part(session, Refused(_REVOKED), Loss.REVOKED)

    def beat(self, beat_s: float) -> None:
        """Ping the links that are due, and find those that are dead; each is pinged again in
        `beat_s`."""
        self._beats += 1
        self._beat_s = beat_s
        self._ping = self._encode_ping(self._beats)
        self.tend()
        due_s = self._loop.time() + self._presence.terms.tick_s / 2
        for session in list(self._sessions.values()):
            for link in list(session.links):
                if link.due_s <= due_s:
                    self.try_link(link)

    def tend(self) -> None:
        """What is due from time to time: end what is over, send what has waited."""
        for session in list(self._sessions.values()):
            if self.gate.has_expired(session.admission):
                self._part(session, Refused(_EXPIRED), Loss.EXPIRED)
                continue
            session.incoming_calls.pass_on_waiting()
        self._presence.tick()

    def try_link(self, link: Link) -> None:
        """Ping a link; one whose connection is gone is broken."""
        self._send_ping(link, self._beats, self._ping)

    def _probe(self, link: Link, number: int) -> None:
        """Ping a link, to be answered."""
        self._send_ping(link, number, self._encode_ping(number))

    def _encode_ping(self, number: int) -> bytes:
        return encode(Ping(number, milliseconds(self._beat_s), self._pulse.state()))

    def _send_ping(self, link: Link, number: int, ping: bytes) -> None:
        now_s = self._loop.time()
        if not link.is_over and link.ping(number, ping, now_s) is Sent.GONE:
            self._loop.call_soon(self._end_gone, link)  # this may be in the midst of draining
            return
        self._presence.pinged(link, now_s, self._beat_s)

    def _end_gone(self, link: Link) -> None:
        """The connection is gone. What came over it is read first: a goodbye, say."""
        if link.is_over:
            return
        if link.route.drain():
            self.break_link(link, Loss.DISCONNECTED)
        else:
            self._loop.call_later(UNREAD_S, self._end_gone, link)

    def _on_dead(self, link: Link) -> None:
        self.break_link(link, Loss.SILENT)

    def close(self) -> None:
        """Say goodbye to all; what runs for peers is cancelled."""
        for dial in self.dials.values():
            dial.close()
        for session in list(self._sessions.values()):
            self._part(session, Bye("closed"), Loss.CLOSED)
        for incoming in list(self._orphans):
            incoming.halt()

    def _greeted(self, link: Link, message: Message) -> None:
        """The first message of a link. Raises `TurnedAway`, `OutOfPlace`."""
        match message:
            case Hello() if not link.dialled:
                admission, known = self._meet(link, message)
                link.version = agreed_version(message, self.gate.identity.name)
                link.tell(Welcome(self._hello(known, link.version)))
                if link.on_peer is not None:
                    link.on_peer()
            case Welcome(hello) if link.dialled:
                admission, known = self._meet(link, hello)
                link.version = agreed_version(hello, self.gate.identity.name)
            case Refused(problem) if link.on_refused is not None:
                link.on_refused(problem)
                return
            case _:
                raise OutOfPlace("a link begins with a greeting")
        self._join(link, admission, known)

    def _meet(self, link: Link, hello: Hello) -> tuple[Admission, Acquaintance]:
        """Let a peer in; what was there before is over if the greeting begins something new."""
        admission = self.gate.admit(hello, link.proved)
        self._check_name(admission)
        known = self._acquaintance(admission.key)
        now_s = self._loop.time()
        if now_s >= known.barred_until_s and not known.greetings.take(1, now_s):
            self._bar(known)
        if now_s < known.barred_until_s:
            raise TurnedAway(Reason.FLOODING, _FLOODING)
        former = known.epoch
        if known.meet(hello) and (session := self._sessions.get(admission.key)):
            self.lose(session, Loss.GAVE_UP if former == hello.epoch else Loss.RESTARTED)
        return admission, known

    def _bar(self, known: Acquaintance) -> None:
        known.barred_until_s = self._loop.time() + BARRED_S

    def _check_name(self, admission: Admission) -> None:
        """Names are what objects are called by: two hosts of one name cannot both be there.

        Raises `TurnedAway`.
        """
        me = self.gate.identity
        names = {me.key: me.name}
        names |= {key: session.admission.name for key, session in self._sessions.items()}
        for key, name in names.items():
            if name == admission.name and key != admission.key:
                raise TurnedAway(Reason.DUPLICATE, _name_taken(name, key, admission.key))

    def _join(self, link: Link, admission: Admission, known: Acquaintance) -> None:
        key = admission.key
        known_session = self._sessions.get(key)
        session = known_session or Session(
            admission, known, self._handler, self._pulse, self._take_in
        )
        self._sessions[key] = session
        self._presence.joined(link, self._beat_s)
        for replaced in session.join(link):
            replaced.cut()
        if known_session is None:
            # After the link has joined: a subscriber to the event may call at once.
            self._on_event(
                PeerUp(key, admission.name, known.epoch, link.route.address, admission.by)
            )
        if dial := self.dials.get(key):
            dial.settled()

    def _hello(self, known: Acquaintance, version: int | None = None) -> Hello:
        me = self.gate.identity
        versions = VERSIONS if version is None else (version,)
        return Hello(versions, me.name, me.key, self.epoch, known.term, me.certificate)

    def _acquaintance(self, key: PeerKey) -> Acquaintance:
        if key not in self._known and len(self._known) >= ACQUAINTANCES:
            for away in self._away():
                del self._known[away]
                break
        if key not in self._known:
            self._known[key] = Acquaintance(allowance=self._allowance.bucket())
        return self._known[key]

    def _away(self) -> Iterator[PeerKey]:
        return (key for key in list(self._known) if key not in self._sessions)

    def _part(self, session: Session, last: Message, reason: Loss) -> None:
        for link in session.links:
            link.tell(last)
        self.lose(session, reason)

    def _keep(self, incoming: IncomingCall) -> None:
        """Keep a call that outlives its caller, until it ends."""
        assert incoming.task is not None
        self._orphans.add(incoming)
        incoming.task.add_done_callback(lambda _: self._orphans.discard(incoming))


_OURS = frozenset({Loss.SILENT, Loss.DISCONNECTED, Loss.VIOLATED, Loss.REVOKED, Loss.EXPIRED})
"""Losses that this host has found: the peer may not know that what was between them is over."""
_REVOKED = Problem("KEY_REVOKED", "this key is not accepted any more")
_EXPIRED = Problem("CERTIFICATE_TIME", "the certificate has ended")
_FLOODING = Problem(
    "PEER_FLOODS",
    f"it has sent more than any host needs to, and is not let in for {BARRED_S:.0f} s",
    fix="look for what it runs that calls or tells others without end",
)


def _name_taken(name: str, holder: PeerKey, newcomer: PeerKey) -> Problem:
    return Problem(
        "PEER_NAME_TAKEN",
        f"two hosts are called {name}: {fingerprint(holder)} is here, and "
        f"{fingerprint(newcomer)} is not let in",
        where=name,
        fix="give one of the hosts another name: `name` under [host]",
    )
