"""What is between two hosts from the first greeting until one loses the other.

It outlives its links: when one breaks, another of the same life and term of the peer takes its
place, and calls that were unanswered are repeated over it.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any, assert_never

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.transport.peers.allowance import Paced
from nondum.transport.peers.calls import Calls
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.events import Loss
from nondum.transport.peers.gate import Acquaintance
from nondum.transport.peers.incoming_calls import Handler, IncomingCall, IncomingCalls
from nondum.transport.peers.link import Link
from nondum.transport.peers.messages import (
    Ask,
    Bye,
    Cancel,
    Failure,
    Hello,
    Message,
    Notice,
    Ping,
    Pong,
    Progress,
    Refused,
    Reply,
    Request,
    Vouch,
    Welcome,
    encode,
)
from nondum.transport.peers.pulse import Pulse
from nondum.transport.peers.trust import Admission

ANSWERED = 8
"""Every eighth ping is answered, to measure the round trip: both hosts ping anyway."""

log = logging.getLogger(__name__)


class Departed(Exception):
    """The peer said that it is going, or that it wants no more."""

    def __init__(self, reason: Loss) -> None:
        super().__init__(reason)
        self.reason = reason


class OutOfPlace(Exception):
    """A message that has no place in a session."""


@frozen
class Doubt:
    """This host was silent for so long that the peer may have given it up."""

    ping: int
    """The number of the one that is to be answered."""
    since_s: float
    """On the loop's clock."""


class Session:
    """A live peer."""

    def __init__(
        self,
        admission: Admission,
        known: Acquaintance,
        handler: Handler,
        pulse: Pulse,
        take_in: Callable[[tuple[Link, Message]], None],
    ) -> None:
        """`take_in` is called with what comes, when the peer may send as much."""
        self.paced = Paced(known.allowance, take_in)
        self.admission, self.known = admission, known
        self.links: list[Link] = []
        """The last one is sent over."""
        self.missing: asyncio.TimerHandle | None = None
        """Ends the session, when the last link has broken."""
        self.doubt: Doubt | None = None
        """Set while it is not known whether the peer has given this host up: what comes waits."""
        self.calls = Calls(admission.name, self.send, known.next_number)
        self.incoming_calls = IncomingCalls(admission, known.once, handler, self.send)
        self._handler, self._pulse = handler, pulse
        self._loop = asyncio.get_running_loop()

    def send(self, data: bytes) -> Sent:
        """Send over the newest link that works."""
        for link in reversed(self.links):
            sent = link.send(data)
            if sent is not Sent.GONE:
                return sent
        return Sent.GONE

    def notify(self, message: Notice) -> Sent:
        """Tell the peer something; not repeated."""
        return self.send(encode(message))

    def join(self, link: Link) -> list[Link]:
        """Go on over a new link, repeating what is unanswered; the links that it replaces."""
        replaced = [one for one in self.links if one.dialled == link.dialled]
        self.links = [one for one in self.links if one.dialled != link.dialled]
        is_first = not self.links and not replaced and self.missing is None
        self.links.append(link)
        link.session = self
        if self.missing is not None:
            self.missing.cancel()
            self.missing = None
        if not is_first:
            self.calls.repeat()
            self.incoming_calls.pass_on_waiting()
        return replaced

    def leave(self, link: Link) -> bool:
        """A link is over; whether others are left. What went over it is repeated on those."""
        was_used = bool(self.links) and self.links[-1] is link
        self.links = [one for one in self.links if one is not link]
        if self.links and was_used:
            self.calls.repeat()
        return bool(self.links)

    def is_free(self, message: Message) -> bool:
        """Whether the peer may say it however much it has said: an answer, or its last word."""
        match message:
            case Reply(number) | Failure(number):
                return self.calls.awaits(number)
            case Pong(number):
                return self.doubt is not None and number == self.doubt.ping
            case Bye() | Refused():
                return True
        return False

    def receive(self, link: Link, message: Message) -> None:
        """Take a message in.

        Raises `Departed`, `OutOfPlace` for one that has no place in a session, and
        `ProtocolViolation` when the handler says so of a notice.
        """
        match message:
            case Request():
                self.incoming_calls.take(message)
            case Reply(number, body):
                self.calls.succeed(number, dict(body))
            case Ping(number, beat_ms, state):
                link.beat_s = beat_ms / 1000
                if number % ANSWERED == 0:
                    link.tell(Pong(number))
                if state is not None:
                    self._pulse.receive(self.admission.key, state)
            case Pong(number):
                link.pong_received(number, self._loop.time())
            case Ask() | Vouch():
                pass  # of those who watch the peers
            case Failure(number, problems):
                self.calls.fail(number, problems)
            case Progress(number, body):
                self.calls.report(number, dict(body))
            case Cancel(number):
                self.incoming_calls.cancel(number)
            case Notice(method, args):
                self._notice(method, dict(args))
            case Bye():
                raise Departed(Loss.DEPARTED)
            case Refused():
                raise Departed(Loss.TURNED_AWAY)
            case Hello() | Welcome():
                raise OutOfPlace("the greeting came twice")
            case _:
                assert_never(message)

    def _notice(self, method: str, args: dict[str, Any]) -> None:
        try:
            self._handler.notice(self.admission, method, args)
        except ProtocolViolation:
            raise
        except Exception:
            log.exception("a notice of %s could not be taken in", self.admission.name)

    def end(self, reason: Loss) -> list[IncomingCall]:
        """The peer is lost: fail the calls to it; its calls that run on here."""
        if self.missing is not None:
            self.missing.cancel()
        self.paced.close()
        self.known.next_number = self.calls.next_number
        told = f"the peer was lost while a call ran: {reason.value}"
        self.calls.lose(Problem("PEER_LOST", told, where=self.admission.name))
        return self.incoming_calls.lose(reason)
