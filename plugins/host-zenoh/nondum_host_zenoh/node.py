"""A host's end of all links to other hosts by way of a Zenoh router.

The sessions are those of `PeerNode`; only what carries their messages is another. The router tells
who is there, so no link is pinged: instead every host tells all others its state now and then, from
the loop that does the work, so that a hung one is noticed.
"""

from __future__ import annotations

import asyncio
import functools
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime

from nondum.sdk.errors import Problem
from nondum.sdk.wire import Body
from nondum.transport.peers.calls import Call
from nondum.transport.peers.dial import FIRST_WAIT_S, LONGEST_WAIT_S
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.events import DialFailed, Loss, PeerEvent
from nondum.transport.peers.failures import PeerUnreachable
from nondum.transport.peers.gate import Gate
from nondum.transport.peers.identity import Identity, Security
from nondum.transport.peers.incoming_calls import Handler
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.link import Link
from nondum.transport.peers.messages import Notice, encode
from nondum.transport.peers.peer_table import PeerTable
from nondum.transport.peers.pulse import Pulse
from nondum.transport.peers.refusals import Reason, Refusals
from nondum.transport.peers.suspicion import Terms
from nondum.transport.peers.trust import Admission, Trust, TrustState
from nondum_host_zenoh.line import Line, Listeners, Place, RouterAccess

log = logging.getLogger(__name__)

SILENCE_S = 10.0
"""A peer that has told nothing for so long hangs: three of its tellings were missed."""
TEND_S = 0.5
TERMS = Terms(
    tick_s=TEND_S,
    shortest_beat_s=7.0,
    longest_beat_s=7.0,
    overdue_s=0.5,
    longest_confirm_s=2.5,
    helpers=0,
)
"""So that it is asked first, and given up after `SILENCE_S`. Others' word would come by way of the
same router, where many that are late together have the most to do."""
ANSWER_S = 8.0
"""How long a greeting may take to be answered."""
START_S = 3.0
"""How long the start waits for a router; it is looked for ever after."""
OVERTAKEN_S = 0.1
"""News that a host is gone may overtake its goodbye."""
MOST_LINK_STATES = 1024
"""Link states that are kept, one for each run of a peer."""


@dataclass(slots=True)
class _LinkState:
    """The link between this host and one run of another."""

    number: int = 0
    """Of the last link; counts up, so that messages of earlier ones are known."""
    link: Link | None = None
    wait_s: float = FIRST_WAIT_S
    timer: asyncio.TimerHandle | None = field(default=None, repr=False)


class _Route:
    """Messages to one place under one number."""

    def __init__(self, line: Line, place: Place, number: int, on_cut: Callable[[], None]) -> None:
        self.address = f"zenoh:{place.epoch}"
        self._line, self._place, self._number, self._on_cut = line, place, number, on_cut

    def send(self, data: bytes) -> Sent:
        """Send without waiting."""
        return self._line.send(self._place, self._number, data)

    def drain(self) -> bool:
        """Nothing can wait: sending is `GONE` only while there is no line to a router."""
        return True

    def cut(self, linger_ms: int = 0) -> None:
        """End it: there is no connection that would, so the other end is told."""
        self._line.send(self._place, self._number, _OVER)
        self._on_cut()


class ZenohNode:
    """Links to the other hosts of a router. `await start()` it, and `await close()` it."""

    def __init__(
        self,
        identity: Identity,
        trust: Trust,
        handler: Handler,
        access: RouterAccess,
        *,
        epoch: int,
        on_event: Callable[[PeerEvent], None],
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        """Made on the running loop.

        Raises `PeerRefused` (ZENOH_MISSING, ADDRESS_MALFORMED, FLEET_NAME, DEVELOPMENT_LOOPBACK).
        """
        if identity.security is Security.DEVELOPMENT:
            for endpoint in access.endpoints:
                identity.check_address(endpoint.replace("/", "://", 1))
        self.identity = identity
        self.refusals = Refusals(on_event)
        self._me = Place(identity.key, epoch)
        self._endpoints = ", ".join(access.endpoints)
        self._on_event = on_event
        self._gate = Gate(identity, trust, clock)
        self._peer_table = PeerTable(
            *(self._gate, epoch, handler, self.refusals, on_event, Pulse()), terms=TERMS
        )
        self._loop = asyncio.get_running_loop()
        listeners = Listeners(self._on_present, self._on_message, self._on_to_all)
        self._line = Line(access, self._me, listeners)
        self._present: set[Place] = set()
        self._link_states: dict[Place, _LinkState] = {}
        self._told: dict[PeerKey, str] = {}
        self._tending: asyncio.TimerHandle | None = None
        self._is_closed = False

    @property
    def peers(self) -> Mapping[PeerKey, Admission]:
        """The peers that can be called now."""
        return {key: session.admission for key, session in self._peer_table.sessions.items()}

    @property
    def problem(self) -> Problem | None:
        """Why no host can be reached now."""
        return self._line.problem

    def round_trip_s(self, peer: PeerKey) -> float | None:
        """Not measured: no peer is pinged."""
        return None

    async def start(self) -> None:
        """Reach a router; goes on trying when there is none yet."""
        self._line.start()
        self._tending = self._loop.call_later(TEND_S, self._tend)
        try:
            async with asyncio.timeout(START_S):
                await self._line.opened.wait()
        except TimeoutError:
            if self.problem is not None:
                log.warning("%s", self.problem)

    def call(self, peer: PeerKey, method: str, args: Body, *, deadline_s: float) -> Call:
        """Call a peer. Raises `PeerUnreachable` and more, as `PeerNode.call`."""
        return self._peer_table.session(peer).calls.begin(method, args, deadline_s)

    def notify(self, peer: PeerKey, method: str, args: Body) -> None:
        """Tell a peer something. Raises as `call` does."""
        if self._peer_table.session(peer).notify(Notice(method, args)) is Sent.FULL:
            raise PeerUnreachable(Problem("PEER_BUSY", "as many messages wait for it as may"))

    def notify_all(self, method: str, args: Body) -> None:
        """Tell every peer something, in one message to the router."""
        now_s = self._loop.time()
        sent = self._line.send_all(encode(Notice(method, args)))
        for link in self._peer_table.links:
            link.note_sent(sent, now_s)

    def turn_away(self, peer: PeerKey, problem: Problem) -> None:
        """Cut a peer that breaks the rules. Raises `PeerUnreachable`."""
        for link in list(self._peer_table.session(peer).links):
            self._peer_table.turn_away(link, Reason.GARBAGE, problem)

    def set_trust(self, trust: Trust) -> None:
        """Exchange the trust: peers that it does not let in any more are cut at once."""
        self._gate.trust = trust
        self._peer_table.check_trust()
        for place in self._present:
            self._greet_in(place, 0)

    async def close(self) -> None:
        """Say goodbye and let go of everything; what runs for peers is cancelled."""
        self._is_closed = True
        if self._tending is not None:
            self._tending.cancel()
        self._peer_table.close()
        for state in self._link_states.values():
            if state.timer is not None:
                state.timer.cancel()
        await self._line.close()

    def _on_present(self, place: Place, is_there: bool) -> None:  # noqa: FBT001  # told by the line
        if self._is_closed or place.key == self._me.key:
            return
        if is_there:
            self._present.add(place)
            self._greet_in(place, 0)
            return
        self._present.discard(place)
        self._loop.call_later(OVERTAKEN_S, self._on_gone, place)

    def _on_gone(self, place: Place) -> None:
        state = self._link_states.get(place)
        if place not in self._present and state is not None and state.link is not None:
            self._peer_table.break_link(state.link, Loss.DISCONNECTED)

    def _on_message(self, place: Place, number: int, data: bytes) -> None:
        if self._is_closed or place.key == self._me.key:
            return
        state = self._link_state(place)
        if data == _OVER:
            if state.link is not None and number == state.number:
                self._peer_table.break_link(state.link, Loss.DISCONNECTED)
            return
        if number > state.number and not self._is_greeter(place):
            self._open(state, place, number, dialled=False)
        if number == state.number and state.link is not None:
            self._peer_table.receive(state.link, data)

    def _on_to_all(self, place: Place, data: bytes) -> None:
        state = self._link_states.get(place)
        if state is None:
            return
        if state.link is None:
            self._line.send(place, state.number, _OVER)  # it may not know yet
        elif state.link.session is not None:
            self._peer_table.receive(state.link, data)

    def _is_greeter(self, place: Place) -> bool:
        """Of two hosts, the one with the smaller key greets."""
        return self._me.key < place.key

    def _is_welcome(self, key: PeerKey) -> bool:
        if self.identity.security is Security.DEVELOPMENT:
            return True
        return self._gate.trust.state_of(key) in (TrustState.ADMITTED, TrustState.MUST_CERTIFY)

    def _link_state(self, place: Place) -> _LinkState:
        if place not in self._link_states and len(self._link_states) >= MOST_LINK_STATES:
            self._forget_link_state()
        return self._link_states.setdefault(place, _LinkState())

    def _forget_link_state(self) -> None:
        unused = (
            at for at, state in self._link_states.items() if state.link is None and not state.timer
        )
        others = (at for at, state in self._link_states.items() if _is_stranger(state))
        gone = next(unused, None) or next(others, None)
        if gone is not None:
            del self._link_states[gone]

    def _open(self, state: _LinkState, place: Place, number: int, *, dialled: bool) -> Link:
        replaced, state.link = state.link, None
        if replaced is not None:
            replaced.cut()
        state.number = number
        route = _Route(self._line, place, number, lambda: self._on_cut(place, number))
        # The key is not proved: any host that the router accepts is believed.
        proved = place.key if self.identity.security is Security.CURVE else None
        state.link = Link(route, proved, self._loop.time(), dialled=dialled)
        return state.link

    def _greet_in(self, place: Place, wait_s: float) -> None:
        if not self._is_greeter(place):
            return
        state = self._link_state(place)
        if state.timer is None:
            state.timer = self._loop.call_later(wait_s, self._greet, place, state)

    def _greet(self, place: Place, state: _LinkState) -> None:
        state.timer = None
        if place not in self._present or state.link is not None or not self._is_welcome(place.key):
            return
        number = max(state.number + 1, int(self._loop.time() * 1000))
        link = self._open(state, place, number, dialled=True)
        link.on_refused = functools.partial(self._on_refused, link, place)
        state.timer = self._loop.call_later(ANSWER_S, self._expect, place, state, link)
        self._peer_table.greet(link, place.key)

    def _expect(self, place: Place, state: _LinkState, link: Link) -> None:
        """The greeting should have been answered by now."""
        state.timer = None
        if link.session is None and not link.is_over:
            self._on_refused(link, place, _UNANSWERED)
        elif link.is_over:
            self._greet_in(place, state.wait_s)

    def _on_refused(self, link: Link, place: Place, problem: Problem) -> None:
        self._tell(place.key, problem)
        link.cut()

    def _on_cut(self, place: Place, number: int) -> None:
        """A link is over: greet again, if the other is still there."""
        state = self._link_states.get(place)
        if state is None or state.number != number or state.link is None:
            return
        link, state.link = state.link, None
        if state.timer is not None:
            state.timer.cancel()
            state.timer = None
        if link.session is not None:
            state.wait_s = FIRST_WAIT_S
            self._told.pop(place.key, None)
        if not self._is_closed and place in self._present:
            self._greet_in(place, state.wait_s)
            state.wait_s = min(2 * state.wait_s, LONGEST_WAIT_S)

    def _tell(self, key: PeerKey, problem: Problem) -> None:
        if self._told.get(key) != problem.code:
            self._told[key] = problem.code
            self._on_event(DialFailed(key, self._endpoints, problem))

    def _tend(self) -> None:
        self._tending = self._loop.call_later(TEND_S, self._tend)
        self._peer_table.tend()
        now_s = self._loop.time()
        for state in list(self._link_states.values()):
            if _is_stranger(state) and state.link and now_s - state.link.heard_s > SILENCE_S:
                state.link.cut()


def _is_stranger(state: _LinkState) -> bool:
    return state.link is None or state.link.session is None


_OVER = b""
"""A message without a word: the link of that number is over."""
_UNANSWERED = Problem("PEER_SILENT", "it is with the router, but does not answer")
