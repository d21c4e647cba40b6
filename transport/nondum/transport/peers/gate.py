"""Decides who is let in: at the handshake by key, at the greeting by certificate. No sockets."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime

from nondum.sdk.errors import NondumError, Problem
from nondum.transport.link.token_bucket import TokenBucket
from nondum.transport.peers.allowance import USUAL, greetings
from nondum.transport.peers.call_history import CallHistory
from nondum.transport.peers.enquiries import asks
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.identity import Identity, Security, is_loopback
from nondum.transport.peers.keys import PeerKey, fingerprint
from nondum.transport.peers.messages import Hello, agreed_version
from nondum.transport.peers.refusals import Reason
from nondum.transport.peers.trust import Admission, Trust, TrustState
from nondum.transport.peers.zap import DOMAIN, ConnectionAttempt, Entry

PAST_EPOCHS = 8
"""Lives of a peer that are remembered as over."""


class TurnedAway(Exception):
    """A connection is not let in; `reason` for the counts, `problem` for the other end."""

    def __init__(self, reason: Reason, problem: Problem) -> None:
        super().__init__(reason, problem)
        self.reason, self.problem = reason, problem


@dataclass(slots=True)
class Acquaintance:
    """What is remembered of an admitted peer while it is away."""

    term: int = 1
    """Ours: how often this host gave up links to it, plus one."""
    epoch: int = 0
    """Theirs."""
    their_term: int = 0
    past: deque[int] = field(default_factory=lambda: deque(maxlen=PAST_EPOCHS))
    once: CallHistory = field(default_factory=CallHistory)
    next_number: int = 1
    allowance: TokenBucket = field(default_factory=USUAL.bucket)
    """What it may still send unasked."""
    barred_until_s: float = float("-inf")
    """It has sent more: on the loop's clock."""
    greetings: TokenBucket = field(default_factory=greetings)
    asks: TokenBucket = field(default_factory=asks)
    """What it may still ask about others."""

    def meet(self, hello: Hello) -> bool:
        """Take a greeting in; whether it begins something new, so that what ran before is over.

        Raises `TurnedAway` (DUPLICATE) for the greeting of a life or a term that is over.
        """
        if hello.epoch in self.past or (hello.epoch == self.epoch and hello.term < self.their_term):
            raise TurnedAway(Reason.DUPLICATE, _stale(hello))
        is_new = (hello.epoch, hello.term) != (self.epoch, self.their_term)
        if hello.epoch != self.epoch:
            self.past.append(self.epoch)
            self.epoch, self.once = hello.epoch, CallHistory()
        self.their_term = hello.term
        return is_new


class Gate:
    """Holds the trust, which may be exchanged at any time."""

    def __init__(self, identity: Identity, trust: Trust, clock: Callable[[], datetime]) -> None:
        """`clock` tells the time of day: only certificates need it."""
        self.identity, self._clock = identity, clock
        self.trust = trust

    def is_revoked(self, key: PeerKey) -> bool:
        """Whether a message under this key may no longer be read."""
        return key in self.trust.revoked

    def admit(self, hello: Hello, proved: PeerKey | None) -> Admission:
        """Let a peer in by its greeting, over a link that proved a key (None in development).

        Raises `TurnedAway`.
        """
        try:
            agreed_version(hello, self.identity.name)
        except NondumError as error:
            raise TurnedAway(Reason.VERSION, error.problems[0]) from error
        key = PeerKey(hello.key)
        if self.identity.security is Security.CURVE and proved != key:
            raise TurnedAway(Reason.NOT_PROVED, _not_proved(hello, proved))
        if key == self.identity.key:
            raise TurnedAway(Reason.DUPLICATE, _itself(hello))
        if self.identity.security is Security.DEVELOPMENT:
            return Admission(key, hello.name, "development")
        try:
            return self.trust.admit(key, hello.certificate, self._clock())
        except PeerRefused as refused:
            reason = _REASONS.get(refused.code, Reason.CERTIFICATE)
            raise TurnedAway(reason, refused.problems[0]) from refused

    def still_admits(self, admission: Admission) -> bool:
        """Whether a peer that was let in may stay, by the trust of now."""
        if self.identity.security is Security.DEVELOPMENT:
            return True
        if admission.by == "pairing":
            return admission.key in self.trust.paired
        return self.trust.state_of(admission.key) is TrustState.MUST_CERTIFY

    def has_expired(self, admission: Admission) -> bool:
        """Whether the certificate that let a peer in has ended."""
        return admission.until is not None and self._clock() > admission.until


_REASONS = {"KEY_REVOKED": Reason.REVOKED, "KEY_UNKNOWN": Reason.UNKNOWN_KEY}


def judge(attempt: ConnectionAttempt, me: Identity, trust: Trust) -> Reason | None:
    """Whether a connection to a host may go on to greet: None, or why not."""
    if attempt.domain != DOMAIN:
        return Reason.WRONG_DOMAIN
    if me.security is Security.DEVELOPMENT:
        is_here = attempt.mechanism == "NULL" and is_loopback(attempt.address)
        return None if is_here else Reason.MISMATCH
    if attempt.mechanism != "CURVE":
        return Reason.MISMATCH
    if attempt.key == me.key:
        return Reason.DUPLICATE
    match trust.state_of(PeerKey(attempt.key)):
        case TrustState.REVOKED:
            return Reason.REVOKED
        case TrustState.UNKNOWN:
            return Reason.UNKNOWN_KEY
        case TrustState.ADMITTED | TrustState.MUST_CERTIFY:
            return None


def entry(reason: Reason | None) -> Entry:
    """The answer at the handshake."""
    return Entry.LET_IN if reason is None else Entry.TURNED_AWAY


def _stale(hello: Hello) -> Problem:
    return Problem(
        "PEER_DUPLICATE",
        "a host with this key has greeted later than this life of it began: two hosts share one "
        "key, or this is an old connection",
        where=hello.name,
        fix="give the copied host new keys, if there are two",
    )


def _itself(hello: Hello) -> Problem:
    return Problem(
        "PEER_DUPLICATE",
        "this is the host itself, or a copy of it with the same key",
        where=hello.name,
        fix="give the copied host new keys, if there are two",
    )


def _not_proved(hello: Hello, proved: PeerKey | None) -> Problem:
    return Problem(
        "PEER_NOT_PROVED",
        "it names another key than the link has proved",
        where=hello.name,
        have=fingerprint(proved) if proved else "none",
    )
