"""Hosts that are not let in, here or there, since two have one name: every status says so."""

from __future__ import annotations

from collections.abc import Callable, Container

from nondum.sdk.errors import Problem
from nondum.transport.fleet import FleetEvent
from nondum.transport.peers import DialFailed, PeerKey, PeerUp, Refusal

RECENT_S = 30.0
"""A host that was turned away tries again within seconds: when it has not, it is gone."""
MOST_KEPT = 16


class Namesakes:
    """Remembers them while they are there."""

    def __init__(
        self, clock: Callable[[], float], hinted: Callable[[], Container[PeerKey]]
    ) -> None:
        """`clock` gives seconds; `hinted` are the hosts that may be there, as discovery says."""
        self._clock, self._hinted = clock, hinted
        self._seen: dict[PeerKey, tuple[Problem, float]] = {}

    def on_fleet(self, event: FleetEvent) -> None:
        """Take in news of peers."""
        match event:
            case DialFailed(key, _, problem) if problem.code == "PEER_NAME_TAKEN":
                self._add(key, problem)
            case Refusal(key=key, problem=Problem(code="PEER_NAME_TAKEN") as problem):
                self._add(PeerKey(key), problem)
            case PeerUp(key):
                self._seen.pop(key, None)

    @property
    def problems(self) -> tuple[Problem, ...]:
        """One for each that is there."""
        hinted, since_s = self._hinted(), self._clock() - RECENT_S
        found = (
            problem
            for key, (problem, at_s) in self._seen.items()
            if key in hinted or at_s >= since_s
        )
        return tuple(dict.fromkeys(found))

    def _add(self, key: PeerKey, problem: Problem) -> None:
        if key not in self._seen and len(self._seen) >= MOST_KEPT:
            del self._seen[next(iter(self._seen))]
        self._seen[key] = problem, self._clock()
