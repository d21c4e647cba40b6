"""Carries a pairing between two hosts: at most one try at a time, in a window that a person opened.

Addresses and keys to ask at are hints, and names are claims. What proves them is the code that two
people compare (see `pairing`).
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import zmq

from nondum.sdk.errors import NondumError, Problem
from nondum.transport.peers import descriptors, pairing, pairing_problems, tcp
from nondum.transport.peers.dial import ANSWER_S, Attempt, Dial
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.events import DialFailed
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.identity import Identity
from nondum.transport.peers.keys import PeerKey, fingerprint
from nondum.transport.peers.link import Link
from nondum.transport.peers.listener import Context, dialling
from nondum.transport.peers.pairing import (
    NONCE_BYTES,
    TRIES,
    Ask,
    Commit,
    Pairing,
    PairingWindow,
    Role,
    Step,
)
from nondum.transport.peers.pairing_listener import MOST_SENT, Asker, PairingListener
from nondum.transport.peers.pairing_messages import MAX_BYTES, Beat, Ended, Ending, decode, encode
from nondum.transport.peers.pairing_state import (
    Agreed,
    Comparing,
    Failed,
    Idle,
    PairingState,
    Waiting,
)
from nondum.transport.peers.refusals import Reason, Refusal, Refusals
from nondum.transport.peers.routes import DialledRoute
from nondum.transport.peers.sockets import Receiver

BEAT_S = 0.25
LINGER_MS = 500
"""How long the last words have to leave."""


@dataclass(slots=True)
class Try:
    """One attempt to pair, from either end."""

    link: Link
    asker: Asker | None
    """None where this host has asked."""
    pairing: Pairing
    before: PairingWindow
    """As it was, should this try not count."""
    begun_s: float


class PairingHost:
    """One window, in which this host can ask and be asked. `open` it, and `await close()` it."""

    def __init__(
        self,
        identity: Identity,
        on_change: Callable[[PairingState], None],
        *,
        is_wanted: Callable[[PeerKey, str], bool] = lambda key, name: True,
        holder: Callable[[str], PeerKey | None] = lambda name: None,
        on_refusal: Callable[[Refusal], None] = lambda refusal: None,
    ) -> None:
        """`on_change` is told of every new state, the last of which is `Agreed` or `Failed`, and
        `on_refusal` of everybody who was turned away.

        `is_wanted` says whether this host may be paired with a key that calls itself so, `holder`
        which host is known by a name already.
        Raises `PeerRefused` (PAIRING_DEVELOPMENT) for a host without keys.
        """
        if identity.keys is None:
            told = "a host without keys has nothing to be paired by"
            fix = "set `development = false` under [peers]"
            raise PeerRefused(Problem("PAIRING_DEVELOPMENT", told, fix=fix))
        self._name, self._keys = identity.name, identity.keys
        self._on_change, self._is_wanted, self._holder = on_change, is_wanted, holder
        self.refusals = Refusals(on_refusal)
        self._loop = asyncio.get_running_loop()
        self._context: Context | None = None
        self._window = PairingWindow(0.0)
        self._listener: PairingListener | None = None
        self._dial: Dial | None = None
        self._try: Try | None = None
        self._confirmed: PeerKey | None = None
        """The host whose code the person here has confirmed: the yes holds in a later try, too."""
        self._came_to_nothing: Problem | None = None
        """What became of the last try with the host that is asked now."""
        self._timers: list[asyncio.TimerHandle] = []
        self.state: PairingState = Idle()

    @property
    def seconds_left(self) -> float:
        """Until the window closes."""
        ends_s = self._window.opened_s + pairing.WINDOW_S
        return 0.0 if self._is_over else max(0.0, ends_s - self._loop.time())

    @property
    def is_trying(self) -> bool:
        """Whether another host has been met, and it is not settled yet what comes of it."""
        return self._try is not None

    def open(self, address: str = "tcp://*:*") -> int:
        """Open the window, once; the port at which this host can be asked from now on.

        Raises `PeerRefused` (ZAP_TAKEN, ADDRESS_UNUSABLE).
        """
        try:
            descriptors.see_that_there_are()
            self._context = zmq.Context()
            self._listener = PairingListener(
                self._context, self._keys, address, self._on_asked, self.refusals
            )
        except (OSError, zmq.ZMQError) as error:
            told = f"this host cannot be asked there: {error.strerror}"
            fix = descriptors.remedy(error)
            problem = Problem("ADDRESS_UNUSABLE", told, where=address, fix=fix)
            raise PeerRefused(problem) from error
        now_s = self._loop.time()
        self._window = PairingWindow(now_s)
        self._timers = [
            self._loop.call_at(now_s + pairing.WINDOW_S, self._time_is_over),
            self._loop.call_later(BEAT_S, self._beat),
        ]
        self._become(self._waiting(None))
        return self._listener.port

    def ask(self, key: PeerKey, addresses: Sequence[str]) -> None:
        """Ask the host that may be at one of these addresses, until it answers.

        Asking another one gives up the last. Nothing happens once the window is closed.
        """
        assert self._listener is not None, "the window is opened first"
        if self._is_over:
            return
        if self._dial is not None:
            self._dial.close()
        self._came_to_nothing = None
        self._dial = Dial(
            key,
            addresses,
            connect=self._connect,
            is_wanted=lambda _: self._try is None and not self._is_over,
            on_won=self._on_won,
            on_over=self._on_attempt_over,
            on_data=self._on_answered,
            on_misused=self._on_misused,
            on_event=self._on_dial_failed,
        )

    def confirm(self, code: str) -> None:
        """The person here sees this code on both hosts.

        Raises `PeerRefused`: PAIRING_ORDER when there is none to confirm, PAIRING_CODE for another
        than the one that is shown now.
        """
        shown = self.state
        if not isinstance(shown, Comparing) or self._try is None:
            raise PeerRefused(Problem("PAIRING_ORDER", "there is no code to confirm"))
        if _digits(code) != _digits(shown.code):
            told = "this is not the code that is shown here"
            fix = "if both hosts show different codes, say no: somebody is between them"
            raise PeerRefused(Problem("PAIRING_CODE", told, need=shown.code, have=code, fix=fix))
        self._confirmed = shown.key
        self._say_yes(self._try)

    def refuse(self) -> None:
        """The person here says no, or wants no pairing any more."""
        if not self._is_over:
            self._end(Failed(pairing_problems.SAID_NO), Ending.REFUSED)

    async def close(self) -> None:
        """Close the window, if it is open still, and let go of everything."""
        if not self._is_over:
            self._end(Failed(pairing_problems.CLOSED), Ending.OVER)
        if self._context is None:
            return
        ending = asyncio.ensure_future(asyncio.to_thread(self._context.term))
        try:
            await asyncio.shield(ending)
        finally:  # the context must go, also when the task that waits for it is cancelled
            await asyncio.wait({ending})

    @property
    def _is_over(self) -> bool:
        return isinstance(self.state, Agreed | Failed)

    # Being asked

    def _on_asked(self, asker: Asker, data: bytes) -> None:
        if self._listener is None or self._is_over:
            return
        current = self._try.asker if self._try else None
        if current is not None and current.id == asker.id:
            self._hear(data, asker.proved)  # ids are the other end's choice, keys are not
            return
        try:
            message = decode(data)
        except NondumError as error:
            self._listener.turn_away(asker, str(error))
            return
        if isinstance(message, Ask):
            self._on_ask(asker, self._listener.link(asker), data, message.name)
        else:
            self._listener.turn_away(asker, "nothing was asked for yet")

    def _on_ask(self, asker: Asker, link: Link, data: bytes, name: str) -> None:
        if self._try is not None:
            _part(link, Ending.BUSY)
        elif not self._is_wanted(asker.proved, name):
            _part(link, Ending.UNWANTED)
        elif problem := self._name_taken(asker.proved, name):
            _part(link, Ending.NAME)
            self._end(Failed(problem), None)
        elif self._begin(Role.ANSWERING, link, asker):
            self._hear(data, asker.proved)

    # Asking

    def _connect(self, key: PeerKey, address: str, receiver: Receiver) -> DialledRoute:
        return DialledRoute(partial(self._dialling, key), address, receiver)

    def _dialling(self, key: PeerKey) -> zmq.Socket[bytes]:
        assert self._context is not None
        socket = dialling(self._context, self._keys, key)
        socket.setsockopt(zmq.MAXMSGSIZE, MAX_BYTES)
        return socket

    def _on_won(self, attempt: Attempt) -> None:
        key = attempt.dial.key
        attempt.link = Link(attempt, key, self._loop.time(), dialled=True)
        if self._try is not None:
            attempt.link.cut()
        elif begun := self._begin(Role.ASKING, attempt.link, None):
            attempt.link.send(encode(pairing.ask(begun.pairing)))

    def _on_answered(self, link: Link, data: bytes) -> None:
        if self._try is not None and self._try.link is link:
            assert link.proved is not None
            self._hear(data, link.proved)

    def _on_misused(self, link: Link, _reason: Reason) -> None:
        if self._try is not None and self._try.link is link:
            self._give_up(pairing_problems.BROKEN, Ending.BROKEN)

    def _on_attempt_over(self, attempt: Attempt) -> None:
        if self._try is not None and self._try.link is attempt.link:
            self._give_up(pairing_problems.VANISHED, None)

    def _on_dial_failed(self, event: DialFailed) -> None:
        """A host that has closed its window is silent: why it has says more than that."""
        if isinstance(self.state, Waiting) and self._came_to_nothing is None:
            self._become(self._waiting(event.problem))

    # One try

    def _begin(self, role: Role, link: Link, asker: Asker | None) -> Try | None:
        """Begin a try; or, if there were too many, end it all."""
        now_s = self._loop.time()
        nonce = secrets.token_bytes(NONCE_BYTES)
        try:
            window, begun = self._window.begin(role, self._keys.public, self._name, nonce, now_s)
        except PeerRefused as refused:
            _part(link, Ending.TRIES)
            self._end(Failed(refused.problems[0]), None)
            return None
        self._try = Try(link, asker, begun, self._window, now_s)
        self._window = window
        return self._try

    def _hear(self, data: bytes, proved: PeerKey) -> None:
        """A message of the try came."""
        current = self._try
        assert current is not None
        try:
            said = decode(data)
            match said:
                case Beat():
                    return
                case Ended(why):
                    self._other_ended(current, why)
                    return
                case Commit(key, name, _):
                    self._check_wanted(key, name)
                    if problem := self._name_taken(key, name):
                        self._end(Failed(problem), Ending.NAME)
                        return
            current.pairing, answers = pairing.receive(
                current.pairing, said, proved, self._loop.time()
            )
        except NondumError as error:
            self._give_up(error.problems[0], Ending.BROKEN)
            return
        for answer in answers:
            current.link.send(encode(answer))
        self._moved(current)

    def _check_wanted(self, key: PeerKey, name: str) -> None:
        if not self._is_wanted(key, name):
            told = "another host answered than the one that is awaited, or a revoked one"
            raise PeerRefused(Problem("PAIRING_UNWANTED", told, where=f"{name} {fingerprint(key)}"))

    def _name_taken(self, key: PeerKey, name: str) -> Problem | None:
        if name == self._name:
            return pairing_problems.same_name(name)
        holder = self._holder(name)
        if holder is not None and holder != key:
            return pairing_problems.name_known(name, key, holder)
        return None

    def _say_yes(self, current: Try) -> None:
        current.pairing, said = pairing.confirm(current.pairing, self._loop.time())
        for message in said:
            current.link.send(encode(message))
        self._moved(current)

    def _moved(self, current: Try) -> None:
        """Show how far the try is."""
        found = current.pairing
        assert found.peer_key is not None
        if found.step is Step.COMPARING and found.peer_key == self._confirmed:
            self._say_yes(current)
            return
        if found.step is Step.PAIRED:
            self._end(Agreed(found.peer_key, found.peer_name), None)
        elif found.step in (Step.COMPARING, Step.AWAITING_AGREED):
            if self._dial is not None and current.link.dialled:
                self._dial.settled()  # people take longer than its attempts may
            is_confirmed = found.step is Step.AWAITING_AGREED
            self._become(Comparing(found.code, found.peer_name, found.peer_key, is_confirmed))

    def _other_ended(self, current: Try, why: Ending) -> None:
        found = current.pairing
        problem = pairing_problems.ended(
            why,
            found.peer_name,
            own_name=self._name,
            is_confirmed=found.step is Step.AWAITING_AGREED,
            is_confirmed_there=found.peer_agreed,
        )
        if why is Ending.NAME or (why is Ending.REFUSED and found.has_told_nonce):
            self._end(Failed(problem), None)
        else:
            self._give_up(problem, None)

    def _give_up(self, problem: Problem, told: Ending | None) -> None:
        """The try came to nothing; the window stays open for others."""
        current, self._try = self._try, None
        assert current is not None
        if not current.pairing.has_told_nonce:
            self._window = current.before
        if told is not None:
            _part(current.link, told)
        else:
            current.link.cut()
        self._came_to_nothing = problem
        self._become(self._waiting(problem))
        if self._dial is not None:
            self._dial.again()

    # The window

    def _end(self, state: Agreed | Failed, told: Ending | None) -> None:
        """Close the window; all of it goes, and `state` stays."""
        current, self._try = self._try, None
        for timer in self._timers:
            timer.cancel()
        if current is not None:
            if told is not None:
                current.link.send(encode(Ended(told)))
            current.link.cut(LINGER_MS)
        if self._dial is not None:
            self._dial.close()  # after the link, of which it would leave nothing
        if self._listener is not None:
            self._listener.close(LINGER_MS)
        self._become(state)

    def _time_is_over(self) -> None:
        match self.state:
            case Comparing(_, name, _, is_confirmed) if self._try is not None:
                problem = pairing_problems.unanswered(
                    name,
                    is_confirmed=is_confirmed,
                    is_confirmed_there=self._try.pairing.peer_agreed,
                )
            case Waiting(_, last):
                problem = pairing_problems.unmet(last)
            case _:
                problem = pairing_problems.unmet(None)
        self._end(Failed(problem), Ending.OVER)

    def _beat(self) -> None:
        """Check, now and then, what no event tells of."""
        self._timers[-1] = self._loop.call_later(BEAT_S, self._beat)
        assert self._listener is not None
        self._listener.cut_overdue()
        if self._try is None:
            return
        is_slow = self._loop.time() - self._try.begun_s > ANSWER_S
        if self._try.link.send(encode(Beat())) is Sent.GONE:
            self._vanished(self._try)
        elif is_slow and not self._try.pairing.has_told_nonce:
            self._give_up(pairing_problems.VANISHED, Ending.BROKEN)
        elif _sent_too_much(self._try):
            self._give_up(pairing_problems.BROKEN, Ending.BROKEN)

    def _vanished(self, current: Try) -> None:
        """The connection is gone. Why may wait to be read, if need be until the next beat."""
        if current.link.route.drain() and self._try is current:
            self._give_up(pairing_problems.VANISHED, None)

    def _waiting(self, problem: Problem | None) -> Waiting:
        return Waiting(TRIES - self._window.tries, problem)

    def _become(self, state: PairingState) -> None:
        self.state = state
        self._on_change(state)


def _part(link: Link, why: Ending) -> None:
    link.send(encode(Ended(why)))
    link.cut(LINGER_MS)


def _sent_too_much(current: Try) -> bool:
    """ZeroMQ bounds messages, but not their number of parts: see `received`."""
    if current.asker is not None:
        state = tcp.state(current.asker.descriptor)
        return state is not None and state.bytes_received > MOST_SENT
    attempt = current.link.route
    assert isinstance(attempt, Attempt) and isinstance(attempt.route, DialledRoute)
    received = attempt.route.received
    return received is not None and received.ahead(received.read()) > MOST_SENT


def _digits(code: str) -> str:
    return "".join(code.split())
