"""Hosts that are not let in, here or there, since two have one name: every status says so."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from nondum.sdk.errors import Problem
from nondum.transport.discovery import Hint
from nondum.transport.fleet import FleetEvent
from nondum.transport.peers import DialFailed, PeerKey, PeerUp, Refusal, fingerprint

RECENT_S = 30.0
"""A host that was turned away tries again within seconds: when it has not, it is gone."""
MOST_KEPT = 16


class NameConflicts:
    """Remembers them while they are there."""

    def __init__(
        self, name: str, clock: Callable[[], float], hints: Callable[[], Iterable[Hint]]
    ) -> None:
        """`name` is this host's, `clock` gives seconds; `hints` are the hosts that may be there, as
        discovery says."""
        self._name, self._clock, self._hints = name, clock, hints
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
        """One for each that was not let in and is there; one for a host of this one's name that is
        only announced, for it is a stranger and never tries."""
        hinted, since_s = {hint.key: hint for hint in self._hints()}, self._clock() - RECENT_S
        found = [
            problem
            for key, (problem, at_s) in self._seen.items()
            if key in hinted or at_s >= since_s
        ]
        own = (_announced(hint) for hint in hinted.values() if hint.name == self._name)
        return tuple(dict.fromkeys(found)) or tuple(own)[:1]

    def _add(self, key: PeerKey, problem: Problem) -> None:
        if key not in self._seen and len(self._seen) >= MOST_KEPT:
            del self._seen[next(iter(self._seen))]
        self._seen[key] = problem, self._clock()


def _announced(hint: Hint) -> Problem:
    return Problem(
        "PEER_NAME_TAKEN",
        f"another host is called {hint.name}, too: {fingerprint(hint.key)} at "
        f"{', '.join(hint.addresses)}",
        where=hint.name,
        fix="give one of the two another name, `name` under [host], and start it again",
    )
