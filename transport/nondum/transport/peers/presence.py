"""Watches the peers: asks late ones, directly and through other peers, and gives up silent ones.

`suspicion` has the rules and times. No sockets.

What a lying helper can do: vouch for a dead host, which is then given up later, once, by as long as
a suspected host has to answer. It cannot have a host given up: no message says so.
"""

from __future__ import annotations

import asyncio
import itertools
import random
from collections.abc import Callable, Mapping

from nondum.sdk.frozen import frozen
from nondum.transport.peers.enquiries import Enquiries
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.link import Link
from nondum.transport.peers.messages import Ask, Message, Pong, Vouch, encode
from nondum.transport.peers.session import ANSWERED, Doubt, OutOfPlace, Session
from nondum.transport.peers.suspicion import Awake, Terms, Verdict, Watched

TICKS_AWAKE = 1.5
"""Ticks that count between two looks: if more time has passed, the loop stood still."""
SOONEST_S = 0.001
"""Between two looks at one link."""
HEARD_AGAIN_S = 0.01
"""What comes so soon after something else is no news of who is there: it is not noted."""
FIRST_PROBE = 2**40 * ANSWERED
"""First number of the pings that ask for an answer: hosts answer multiples of `ANSWERED`."""


@frozen
class _Asked:
    """A question that peers were asked."""

    link: Link
    helpers: frozenset[PeerKey]


class Presence:
    """Watches the links of all sessions."""

    def __init__(
        self,
        terms: Terms,
        sessions: Mapping[PeerKey, Session],
        ping: Callable[[Link, int], None],
        on_dead: Callable[[Link], None],
    ) -> None:
        """`ping` sends one with a number; `on_dead` is called when a link is to be given up."""
        self.terms = terms
        self._sessions, self._ping, self._on_dead = sessions, ping, on_dead
        self._loop = asyncio.get_running_loop()
        self._awake = Awake(self._loop.time(), TICKS_AWAKE * terms.tick_s)
        self._probes = itertools.count(FIRST_PROBE, ANSWERED)
        self._asked: dict[int, _Asked] = {}
        self._enquiries = Enquiries()

    def awake_s(self) -> float:
        """How long this host's loop has run."""
        return self._awake.read(self._loop.time())

    def joined(self, link: Link, beat_s: float) -> None:
        """A link became a peer's; `beat_s` counts until each end has said its own."""
        link.beat_s = beat_s
        link.doubt_s = self.terms.doubt_s(beat_s)
        self.received(link)

    def pinged(self, link: Link, now_s: float, beat_s: float) -> None:
        """This host has pinged a peer, and said that it will again in `beat_s`."""
        link.due_s = now_s + beat_s
        link.doubt_s = self.terms.doubt_s(beat_s)

    def received(self, link: Link) -> None:
        """Note that something came over a link."""
        now_s, before = self.awake_s(), link.watched
        if now_s - before.heard_s < HEARD_AGAIN_S and not before.is_suspected:
            return
        link.watched = Watched(now_s)
        link.calm_until_s = now_s + self.terms.suspect_s(link.beat_s) - self.terms.tick_s

    def doubt(self, session: Session) -> None:
        """This host was silent for so long that the peer may have given it up: ask, and carry out
        nothing before the answer."""
        if session.doubt is None:
            session.paced.hold()
            self._ask_about_itself(session)

    def _ask_about_itself(self, session: Session) -> None:
        number = next(self._probes)
        self._ping(session.links[-1], number)
        session.doubt = Doubt(number, self._loop.time())

    def take_in(self, session: Session, link: Link, message: Message) -> None:
        """Take in what is about who is there. Raises `OutOfPlace`."""
        match message:
            case Pong(number):
                self._answered(session, number)
            case Ask() | Vouch() if link.version < 2:
                raise OutOfPlace("the protocol as agreed has no such message")
            case Ask(number, key):
                self._ask_for(session, number, PeerKey(key))
            case Vouch(number):
                asked = self._asked.get(number)
                if asked is not None and session.admission.key in asked.helpers:
                    asked.link.watched = asked.link.watched.vouched()

    def tick(self) -> None:
        """Look at all links; to be called every `terms.tick_s`."""
        self._awake = self._awake.look(self._loop.time())
        for number, asked in list(self._asked.items()):
            if asked.link.is_over or not asked.link.watched.is_suspected:
                del self._asked[number]
        for session in list(self._sessions.values()):
            for link in list(session.links):
                if self._awake.seconds >= link.calm_until_s:
                    self._look(link)
            if session.doubt is not None:
                self._look_at_doubt(session, session.doubt)

    def _look(self, link: Link) -> None:
        if link.is_over:
            return
        now_s = self.awake_s()
        link.watched, verdict = link.watched.look(now_s, self.terms, link.beat_s)
        if verdict is Verdict.DEAD:
            self._on_dead(link)
            return
        if verdict is Verdict.ASK:
            self._ask(link)
        wait_s = link.watched.due_s(self.terms, link.beat_s) - now_s
        if wait_s < self.terms.tick_s and link.looking is None:
            link.looking = self._loop.call_later(max(wait_s, SOONEST_S), self._look_soon, link)

    def _look_at_doubt(self, session: Session, doubt: Doubt) -> None:
        """Ask again over the newest link; a peer that sends, but does not answer, is given up."""
        if self._loop.time() - doubt.since_s > self.terms.limit_s(self.terms.longest_beat_s):
            for link in list(session.links):
                self._on_dead(link)
        elif session.links:
            self._ping(session.links[-1], doubt.ping)

    def _look_soon(self, link: Link) -> None:
        link.looking = None
        self._look(link)

    def _ask(self, link: Link) -> None:
        """A peer is late: ask it, and some others about it."""
        assert link.session is not None
        number, about = next(self._probes), link.session.admission.key
        able = [one for one in self._sessions.values() if one is not link.session and _helps(one)]
        helpers = random.sample(able, min(self.terms.helpers, len(able)))
        self._asked[number] = _Asked(link, frozenset(one.admission.key for one in helpers))
        for helper in helpers:
            helper.send(encode(Ask(number, about)))
        self._ping(link, number)

    def _ask_for(self, asker: Session, number: int, about: PeerKey) -> None:
        """A peer asks about another: ping that, if there is a link to it."""
        session, now_s = self._sessions.get(about), self._loop.time()
        if session is None or session is asker or not session.links:
            return
        if not asker.known.asks.take(1, now_s):
            return
        ping = next(self._probes)
        if self._enquiries.ask(asker.admission.key, number, about, ping, now_s):
            self._ping(session.links[-1], ping)

    def _answered(self, session: Session, number: int) -> None:
        doubt = session.doubt
        if doubt is not None and number == doubt.ping:
            if all([link.confirm(doubt.since_s) for link in session.links]):
                session.doubt = None
                session.paced.release()
            elif session.links:
                self._ask_about_itself(session)
        for asker, asked in self._enquiries.answered(session.admission.key, number).items():
            if waiting := self._sessions.get(asker):
                waiting.send(encode(Vouch(asked)))


def _helps(session: Session) -> bool:
    """Whether a peer can be asked about others."""
    links = session.links
    return bool(links) and links[-1].version >= 2 and not links[-1].watched.is_suspected
