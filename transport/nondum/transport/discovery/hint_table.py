"""The table of current hints, limited in size against floods. Pure; times are given.

A flood of invented hosts may push out other hints, never those of preferred peers or of hosts that
the integrator has given.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.discovery.announcement import DEVELOPMENT
from nondum.transport.discovery.hint import MAX_ADDRESSES, Hint, Source
from nondum.transport.link.token_bucket import TokenBucket
from nondum.transport.peers.keys import PeerKey, fingerprint

MAX_PEERS = 512
NEW_PEERS_PER_S = 32.0
"""How fast unknown peers may come up, after a burst of `MAX_PEERS`."""


@frozen
class ReceivedHint:
    """One hint, and when it was received."""

    hint: Hint
    at_s: float


@frozen
class Change:
    """What a hint has changed."""

    told: Hint | None = None
    """A peer of which something is new."""
    gone: PeerKey | None = None
    """A peer that nothing hints at any more, or that was pushed out."""


class HintTable:
    """Hints by peer, one of each source."""

    def __init__(
        self, key: PeerKey, epoch: int, prefers: Callable[[PeerKey], bool], now_s: float
    ) -> None:
        """`key` and `epoch` are this host's own; `prefers` names peers that matter."""
        self._key, self._epoch = key, epoch
        self._prefers = prefers
        self._received: dict[PeerKey, dict[Source, ReceivedHint]] = {}
        self._newcomers = TokenBucket(NEW_PEERS_PER_S, MAX_PEERS, now_s)
        self.refused: Counter[str] = Counter()
        """Hints that were of no use, by code."""
        self.duplicate: Hint | None = None
        """Another host under this host's key."""

    @property
    def hints(self) -> Mapping[PeerKey, Hint]:
        """One hint a peer, of everything that is said of it."""
        every = ((key, merged(by_source)) for key, by_source in self._received.items())
        return {key: hint for key, hint in every if hint is not None}

    @property
    def received(self) -> tuple[ReceivedHint, ...]:
        """Every hint, the oldest peer first."""
        return tuple(one for by_source in self._received.values() for one in by_source.values())

    def knows(self, key: PeerKey) -> bool:
        """Whether a peer is hinted at."""
        return key in self._received

    def add(self, hint: Hint, now_s: float) -> Change:
        """Take a hint. Those of this host itself are kept apart."""
        if hint.key == self._key:
            if hint.epoch != self._epoch:  # else it is this host's own echo
                self.duplicate = hint
            return Change()
        gone = None
        if hint.key not in self._received:
            if not self._may_enter(hint, now_s):
                self.refused["HINT_CROWDED"] += 1
                return Change()
            gone = self._evict()
        by_source = self._received.setdefault(hint.key, {})
        before = merged(by_source)
        by_source.pop(hint.source, None)
        by_source[hint.source] = ReceivedHint(hint, now_s)  # the last received is the last in order
        return Change(_news(before, merged(by_source)), gone)

    def remove(self, key: PeerKey, source: Source) -> Change:
        """Forget what a source said of a peer."""
        if key == self._key and self.duplicate and self.duplicate.source is source:
            self.duplicate = None
        by_source = self._received.get(key, {})
        if source not in by_source:
            return Change()
        before = merged(by_source)
        del by_source[source]
        if by_source:
            return Change(_news(before, merged(by_source)))
        del self._received[key]
        return Change(gone=key)

    def problem(self) -> Problem | None:
        """What a person must know of another host with this one's key."""
        other = self.duplicate
        if other is None:
            return None
        at = ", ".join(other.addresses)
        if self._key.startswith(DEVELOPMENT):
            told = f"another host is called {other.name}, too, at {at}"
            fix = "give one of the two another name, `name` under [host], and start it again"
            return Problem("PEER_NAME_TAKEN", told, where=other.name, fix=fix)
        return Problem(
            "IDENTITY_DUPLICATE",
            f"another host, {other.name}, has this host's key, at {at}",
            where=fingerprint(self._key),
            fix="one of the two is a copy: delete the key file there, and start that host again",
        )

    def _may_enter(self, hint: Hint, now_s: float) -> bool:
        matters = hint.source is Source.STATIC or self._prefers(hint.key)
        if not matters and not self._newcomers.take(1, now_s):
            return False
        return len(self._received) < MAX_PEERS or self._oldest_stranger() is not None

    def _evict(self) -> PeerKey | None:
        if len(self._received) < MAX_PEERS:
            return None
        oldest = self._oldest_stranger()
        assert oldest is not None
        del self._received[oldest]
        return oldest

    def _oldest_stranger(self) -> PeerKey | None:
        for key, by_source in self._received.items():
            if Source.STATIC not in by_source and not self._prefers(key):
                return key
        return None


def merged(by_source: Mapping[Source, ReceivedHint]) -> Hint | None:
    """All that is said of one peer: the latest, with every address, those given by hand first."""
    if not by_source:
        return None
    latest = list(by_source.values())[-1].hint
    static = by_source.get(Source.STATIC)
    if static is None or len(by_source) == 1:
        return latest
    others = (a for one in by_source.values() for a in one.hint.addresses)
    every = tuple(dict.fromkeys([*static.hint.addresses, *others]))[:MAX_ADDRESSES]
    interface = next((one.hint.interface for one in by_source.values() if one.hint.interface), "")
    return replace(latest, addresses=every, source=Source.STATIC, interface=interface)


def _news(before: Hint | None, after: Hint | None) -> Hint | None:
    return after if after != before else None
