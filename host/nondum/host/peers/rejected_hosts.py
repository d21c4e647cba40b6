"""Announces each host that is turned away once, at a limited rate."""

from __future__ import annotations

from collections.abc import Callable

from nondum.host.core.events.event import Emit
from nondum.host.core.events.peers import PeerTurnedAway
from nondum.host.core.printable import printable
from nondum.sdk.errors import Problem
from nondum.transport.link.token_bucket import TokenBucket
from nondum.transport.peers import PeerKey, Reason, Refusal, fingerprint

BURST, EVERY_S = 5, 60.0
"""BURST hosts are announced at once, then one more every EVERY_S seconds."""
MOST_KNOWN = 1000

_FIXES = {
    Reason.UNKNOWN_KEY: "if it is one of yours: `nondum peers pair` on both",
    Reason.CERTIFICATE: "have the fleet's owner sign a new certificate, or pair the two hosts",
    Reason.DUPLICATE: "give one of the two hosts another name, or its own key",
    Reason.ENDLESS: "look what runs there; if it was taken over, `nondum peers revoke`",
    Reason.FLOODING: "look for what it runs that calls or tells others without end",
}
"""What a person can do; of other reasons people are told nothing, only counts."""


class RejectedHosts:
    """Tells of those who are turned away."""

    def __init__(self, emit: Emit, clock: Callable[[], float]) -> None:
        """`clock` gives seconds."""
        self._emit = emit
        self._clock = clock
        self._bucket = TokenBucket(1 / EVERY_S, BURST, clock())
        self._known: dict[tuple[Reason, str], None] = {}

    def turned_away(self, refusal: Refusal) -> None:
        """Somebody was turned away."""
        fix, key = _FIXES.get(refusal.reason), (refusal.reason, refusal.key)
        if fix is None or not refusal.key or key in self._known:
            return
        if not self._bucket.take(1, self._clock()):
            return
        if len(self._known) >= MOST_KNOWN:
            del self._known[next(iter(self._known))]
        self._known[key] = None
        who, why = fingerprint(PeerKey(refusal.key)), refusal.told
        if refusal.problem is not None:
            why, fix = refusal.problem.message, refusal.problem.fix or fix
        told = f"a host with the key {who} is not let in: {printable(why)}"
        problem = Problem("PEER_STRANGER", told, where=refusal.address, fix=fix)
        self._emit(PeerTurnedAway(who, (problem,)))
