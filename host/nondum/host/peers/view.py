"""Peers as people are shown them: who is here, and why somebody is not. Plain data."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from nondum.host.control.arguments import Arguments
from nondum.host.core.printable import printable
from nondum.host.core.records.peer import PeerRecord
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.row import Row
from nondum.sdk.errors import Problem
from nondum.transport.discovery import DiscoveryStatus, Hint
from nondum.transport.fleet import FleetEvent, Peer
from nondum.transport.peers import (
    DialFailed,
    PeerKey,
    PeerLost,
    PeerUp,
    Refusals,
    Security,
    Trust,
    fingerprint,
)

MOST_KEPT = 512
"""Hosts whose last dials and losses are remembered."""


@dataclass(slots=True)
class _Past:
    """What has happened between this host and one other."""

    name: str = ""
    dials: dict[str, str] = field(default_factory=dict)
    """Address → why it did not lead to the host."""
    up_s: float | None = None
    lost: str = ""
    """Why the link ended last."""
    losses: int = 0


class PeersView:
    """Answers `nondum peers`, from what it is told and what the parts know."""

    def __init__(
        self,
        *,
        security: Security,
        snapshot: Callable[[], Snapshot],
        peers: Callable[[], Mapping[PeerKey, Peer]],
        trust: Callable[[], Trust],
        hints: Callable[[], Iterable[Hint]],
        network: Callable[[], DiscoveryStatus | None],
        refusals: Refusals,
        problems: Callable[[], Iterable[Problem]],
        links_pid: Callable[[], int | None],
    ) -> None:
        self._security, self._snapshot, self._peers, self._trust = security, snapshot, peers, trust
        self._hints, self._network, self._refusals = hints, network, refusals
        self._problems, self._links_pid = problems, links_pid
        self._past: dict[PeerKey, _Past] = {}
        self._loop = asyncio.get_running_loop()

    def on_fleet(self, event: FleetEvent) -> None:
        """Take in news of peers."""
        match event:
            case DialFailed(key, address, problem):
                self._of(key).dials[address] = str(problem)
            case PeerUp(key, name):
                past = self._of(key)
                past.name, past.up_s = name, self._loop.time()
                past.dials.clear()
            case PeerLost(key, name, reason):
                past = self._of(key)
                past.name, past.up_s, past.lost = name, None, reason.value
                past.losses += 1

    def known(self) -> dict[PeerKey, str]:
        """Hosts that are here or were: key → name."""
        return {key: past.name for key, past in self._past.items() if past.name}

    async def rows(self, arguments: Arguments) -> list[Row]:
        """Hosts that are here, and those that are trusted and are not: `peer`, `state`,
        `fingerprint`, `address`, `by`, `round_trip_ms`, `components`, `compute`."""
        records = {record.key: record for record in self._snapshot().peers}
        here = [_row(peer, records.get(peer.key)) for peer in self._peers().values()]
        absent = [
            _absent(key, name)
            for key, name in {**self.known(), **self._trust().paired}.items()
            if key not in self._peers()
        ]
        return sorted([*here, *absent], key=lambda row: (row["state"], row["peer"]))

    async def why(self, arguments: Arguments) -> Row:
        """All that bears on who is here and who is not: `security`, `process` (of the links, where
        they have one), `hosts`, `interfaces`, `static`, `refused` (counts), `latest` refusals,
        `problems`."""
        network, links_pid = self._network(), self._links_pid()
        now_s = self._loop.time()
        return {
            "security": self._security.value,
            "process": links_pid if links_pid != os.getpid() else None,
            "hosts": [self._why(key) for key in sorted(self._every_key())],
            "interfaces": [_aged(asdict(row), now_s) for row in network.interfaces]
            if network
            else [],
            "static": [_aged(asdict(row), now_s) for row in network.static] if network else [],
            "problems": [
                *map(str, self._problems()),
                *map(str, network.problems if network else ()),
            ],
            "hints_of_no_use": dict(network.refused) if network else {},
            "refused": {reason.value: n for reason, n in self._refusals.counts.items()},
            "latest": [
                {
                    "reason": refusal.reason.value,
                    "address": refusal.address,
                    "fingerprint": _print_of(refusal.key),
                    "told": printable(refusal.told),
                    "ago_s": round(now_s - refusal.at_s, 1),
                }
                for refusal in self._refusals.latest
            ],
        }

    def _every_key(self) -> set[PeerKey]:
        trust = self._trust()
        hinted = {hint.key for hint in self._hints()}
        return {*self._peers(), *trust.paired, *trust.revoked, *hinted, *self._past}

    def _why(self, key: PeerKey) -> Row:
        peer, past = self._peers().get(key), self._past.get(key, _Past())
        hints = [hint for hint in self._hints() if hint.key == key]
        name = peer.name if peer else past.name or self._trust().paired.get(key, "")
        return {
            "peer": name or next((hint.name for hint in hints), ""),
            "fingerprint": _print_of(key),
            "state": "here" if peer else "away",
            "standing": self._trust_state(key),
            "announced": [
                {
                    "by": hint.source.value,
                    "interface": hint.interface,
                    "addresses": list(hint.addresses),
                    "versions": list(hint.versions),
                }
                for hint in hints
            ],
            "address": peer.address if peer else "",
            "dialled": dict(past.dials),
            "round_trip_ms": _ms(peer.round_trip_s) if peer else None,
            "here_s": round(self._loop.time() - past.up_s, 1) if past.up_s is not None else None,
            "losses": past.losses,
            "lost": past.lost,
            "revision": peer.revision if peer else None,
        }

    def _trust_state(self, key: PeerKey) -> str:
        if self._security is Security.DEVELOPMENT:
            return "needs no key"
        return self._trust().state_of(key).value

    def _of(self, key: PeerKey) -> _Past:
        if key not in self._past and len(self._past) >= MOST_KEPT:
            del self._past[next(iter(self._past))]
        return self._past.setdefault(key, _Past())


def _row(peer: Peer, record: PeerRecord | None) -> Row:
    return {
        "peer": peer.name,
        "state": "here",
        "fingerprint": _print_of(peer.key),
        "address": peer.address,
        "by": peer.admitted_by,
        "round_trip_ms": _ms(peer.round_trip_s),
        "components": [component.id for component in record.components] if record else [],
        "compute": dict(record.compute) if record else {},
        "problems": [str(problem) for problem in record.problems] if record else [],
    }


def _absent(key: PeerKey, name: str) -> Row:
    return {
        "peer": name,
        "state": "away",
        "fingerprint": _print_of(key),
        "address": "",
        "by": "",
        "round_trip_ms": None,
        "components": [],
        "compute": {},
        "problems": [],
    }


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else round(seconds * 1000, 2)


def _print_of(key: str) -> str:
    """A key for people; in development mode there is none, and names are shown."""
    return fingerprint(PeerKey(key)) if len(key) == 40 else key


def _aged(row: dict[str, Any], now_s: float) -> Row:
    """Moments on the loop's clock as ages, problems as sentences."""
    found: Row = {}
    for name, value in row.items():
        if name.endswith("_s"):
            age = None if value is None else round(now_s - value, 1)
            found[name.removesuffix("_s") + "_ago_s"] = age
        elif name == "problem":
            found[name] = "" if value is None else value["message"]
        else:
            found[name] = list(value) if isinstance(value, tuple) else value
    return found
