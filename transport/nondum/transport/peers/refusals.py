"""Counts of what was turned away, by reason, and the last of it in detail; both bounded."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Mapping
from enum import Enum

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

LATEST = 64
"""How many refusals are kept in detail."""


class Reason(Enum):
    """Why a connection was turned away or cut."""

    UNKNOWN_KEY = "unknown key"
    REVOKED = "revoked"
    CERTIFICATE = "certificate"
    """None, or one that does not hold."""
    NOT_PROVED = "not proved"
    """A message under another key than the link's (`User-Id`)."""
    MISMATCH = "mismatch"
    """Another mechanism (no CURVE), another server key, or a handshake that breaks off."""
    GARBAGE = "garbage"
    """Bytes that are no ZeroMQ, or a message that is none of ours."""
    SILENT = "silent"
    """Connected, and never became a peer."""
    CROWDED = "crowded"
    """Too many connections that are no peers yet."""
    VERSION = "version"
    DUPLICATE = "duplicate"
    """A second host with the same key, or this host itself."""
    FLOODING = "flooding"
    """A peer that sends more than any host needs to."""
    ENDLESS = "endless"
    """A peer that sends a message that does not end."""
    WRONG_DOMAIN = "wrong domain"
    INTERNAL = "internal"


@frozen
class Refusal:
    """One connection that was turned away or cut."""

    reason: Reason
    address: str
    """The other end, as far as it is known."""
    key: str
    """The other end's key, as far as it is known."""
    told: str
    at_s: float
    """On the loop's clock."""
    problem: Problem | None = None
    """What a greeting was answered with."""


class Refusals:
    """Connections that were turned away since the start."""

    def __init__(self, on_refusal: Callable[[Refusal], None]) -> None:
        """`on_refusal` is called for each, or for many at once, when many strangers connect."""
        self._on_refusal = on_refusal
        self._counts: Counter[Reason] = Counter()
        self._latest: deque[Refusal] = deque(maxlen=LATEST)

    @property
    def counts(self) -> Mapping[Reason, int]:
        """How often, by reason."""
        return dict(self._counts)

    @property
    def latest(self) -> tuple[Refusal, ...]:
        """The last ones, oldest first."""
        return tuple(self._latest)

    def add(self, refusal: Refusal) -> None:
        """Count one more, and tell of it."""
        self._counts[refusal.reason] += 1
        self._latest.append(refusal)
        self._on_refusal(refusal)
