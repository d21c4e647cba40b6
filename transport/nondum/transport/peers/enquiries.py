"""What peers ask about others: who waits for which answer, within limits. No sockets.

A host that is asked about another pings it once, and says so if that ping is answered. Asking has
no other effect, so the most that a hostile peer reaches by asking is `PROBES_PER_S` pings to each
peer of the host that it asks, together with everybody else that asks.
"""

from __future__ import annotations

from dataclasses import field

from nondum.sdk.frozen import frozen
from nondum.transport.link.token_bucket import TokenBucket
from nondum.transport.peers.keys import PeerKey

PROBES_PER_S = 4.0
"""Pings to one peer because others ask about it; who asks sooner waits for the last one's answer,
which is as good."""
KEPT_S = 3.0
"""How long an answer is waited for."""
ASKS_PER_S, ASKS = 20.0, 200.0
"""What one peer may ask; more is not answered."""


@frozen
class Enquiry:
    """One ping, and who waits for its answer."""

    about: PeerKey
    began_s: float
    askers: dict[PeerKey, int] = field(default_factory=dict)
    """The number of each one's question."""


def asks() -> TokenBucket:
    """How often one peer may ask."""
    return TokenBucket(ASKS_PER_S, ASKS, 0.0)


class Enquiries:
    """Those that wait for answers."""

    def __init__(self) -> None:
        self._open: dict[int, Enquiry] = {}
        """By the number of the ping, oldest first."""

    def ask(self, asker: PeerKey, number: int, about: PeerKey, ping: int, now_s: float) -> bool:
        """Take a question in; whether `about` is to be pinged for it, with the number `ping`."""
        self._forget_old(now_s)
        for enquiry in self._open.values():
            if enquiry.about == about and now_s - enquiry.began_s < 1 / PROBES_PER_S:
                enquiry.askers[asker] = number
                return False
        self._open[ping] = Enquiry(about, now_s, {asker: number})
        return True

    def answered(self, about: PeerKey, ping: int) -> dict[PeerKey, int]:
        """A peer has answered a ping: who is to be told, and the numbers of their questions."""
        enquiry = self._open.get(ping)
        if enquiry is None or enquiry.about != about:
            return {}
        del self._open[ping]
        return enquiry.askers

    def _forget_old(self, now_s: float) -> None:
        for ping, enquiry in list(self._open.items()):
            if now_s - enquiry.began_s <= KEPT_S:
                break
            del self._open[ping]
