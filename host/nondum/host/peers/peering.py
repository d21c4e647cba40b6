"""This host among others: what it offers is told, what others offer is entered in the catalogue.

Peers' words become events, and from there everything goes the way of a drive that is plugged in or
pulled: catalogue, world, plan, people.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterable, Iterator, Mapping

from nondum.host.core.events.behaviours import BehaviourEnded, BehaviourStarted
from nondum.host.core.events.catalogue import Recomposed
from nondum.host.core.events.event import Emit, Event
from nondum.host.core.events.facts import FactForgotten, FactKnown, StreamFlowing, UnitsTaken
from nondum.host.core.events.peers import PeerJoined, PeerLeft, PeerShared
from nondum.host.core.events.workers import WorkerExited
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.peers.offered_entries import (
    Entries,
    Policy,
    catalogue_entries,
    changes,
    objects_of,
    passing,
)
from nondum.host.peers.peer_entries import (
    Claim,
    Introduced,
    claims_of,
    record_of,
    taken_in,
    withdrawal,
)
from nondum.host.peers.remote_calls import host_of, is_peers
from nondum.sdk.errors import NondumError, Problem
from nondum.sdk.wire import Body
from nondum.transport.fleet.fleet import Fleet, FleetEvent, PeerChanged
from nondum.transport.peers import Call, PeerKey, PeerLost, PeerUnreachable, PeerUp

log = logging.getLogger(__name__)


class Peering:
    """Tells peers what there is here, and this host what there is at its peers."""

    def __init__(
        self,
        host: str,
        fleet: Fleet,
        emit: Emit,
        *,
        snapshot: Callable[[], Snapshot],
        policy: Callable[[], Policy],
        claims: Callable[[str], Iterable[Claim]],
        taken: Callable[[], Mapping[str, str]],
        about: Entries,
    ) -> None:
        """`claims` is what a component of this host says is so, `taken` the facts that do not hold
        since somebody uses what they are about → who; `about` entries that never change."""
        self._host, self._fleet, self._emit = host, fleet, emit
        self._snapshot, self._policy, self._claims_here = snapshot, policy, claims
        self._taken, self._about = taken, about
        self._introduced: dict[PeerKey, Introduced] = {}
        self._claims: dict[PeerKey, dict[str, Claim]] = {}
        self._lasting: Entries = {}
        self._passing: Entries = {}
        self._publishing: asyncio.Handle | None = None
        self._is_recomposed = True

    # What this host tells

    def on_event(self, event: Event) -> None:
        """Take in what happens here, and tell peers what concerns them."""
        match event:
            case Recomposed():
                self._is_recomposed = True
                self._publish_soon()
            case FactKnown(component) | FactForgotten(component) | StreamFlowing(component):
                if not is_peers(component):
                    self._publish_soon()
            case BehaviourStarted() | BehaviourEnded() | WorkerExited():
                self._publish_soon()

    def publish(self) -> None:
        """Tell peers what is not as they were told."""
        self._publishing = None
        snapshot, policy, before = self._snapshot(), self._policy(), self._lasting | self._passing
        if self._is_recomposed:
            self._is_recomposed = False
            self._lasting = self._about | catalogue_entries(snapshot, policy)
        self._passing = passing(snapshot, policy, self._claims_here, self._taken())
        if news := changes(before, self._lasting | self._passing):
            self._tell(news)

    def _publish_soon(self) -> None:
        if self._publishing is None:
            self._publishing = asyncio.get_running_loop().call_soon(self.publish)

    def _tell(self, news: Mapping[str, Body | None]) -> None:
        try:
            self._fleet.publish(news)
        except (NondumError, TypeError) as error:
            log.warning("not all can be shared with peers: %s", error)
            self._tell_one_by_one(news)

    def _tell_one_by_one(self, news: Mapping[str, Body | None]) -> None:
        """What cannot be shared is left out; it must not keep the rest from being."""
        for key, body in news.items():
            try:
                self._fleet.publish({key: body})
            except (NondumError, TypeError) as error:
                log.warning("%s is not shared with peers: %s", key, error)

    # What peers tell

    def on_fleet(self, event: FleetEvent) -> None:
        """Take in news of peers."""
        match event:
            case PeerUp(key, name, epoch, address, admitted_by):
                one = Introduced(key, name, address, admitted_by, f"{epoch:x}")
                self._introduced[key] = one
                self._emit(PeerJoined(key, name, address, admitted_by, one.life))
            case PeerChanged(key, changed, is_whole):
                self._on_changed(key, changed, is_whole=is_whole)
            case PeerLost(key, name, reason):
                self._on_lost(key, name, reason.value)

    def claims(self, component: str) -> Iterator[Claim]:
        """What a peer's component says is so now."""
        key = self.key_of(host_of(component))
        for claim in self._claims.get(key, {}).values() if key else ():
            if claim.component == component:
                yield claim

    def _on_changed(
        self, key: PeerKey, changed: Mapping[str, Body | None], *, is_whole: bool
    ) -> None:
        peer, introduced = self._fleet.peers.get(key), self._introduced.get(key)
        if peer is None or introduced is None:
            return
        kinds = {name.partition("/")[0] for name in changed}
        if is_whole or kinds & {"component", "mount", "device", "compute"}:
            self._emit(PeerShared(introduced.name, record_of(introduced, peer.entries)))
        if is_whole or kinds & {"fact", "flow"}:
            self._take_claims(key, dict(claims_of(introduced.name, peer.entries)))
        if is_whole or "taken" in kinds:
            taken = taken_in(introduced.name, peer.entries, self._host)
            self._emit(UnitsTaken(introduced.name, taken))

    def _take_claims(self, key: PeerKey, now: dict[str, Claim]) -> None:
        before = self._claims.get(key, {})
        self._claims[key] = now
        for name in before.keys() - now.keys():
            self._emit(withdrawal(before[name]))
        for name, claim in now.items():
            if before.get(name) != claim:
                self._emit(claim)

    def _on_lost(self, key: PeerKey, name: str, reason: str) -> None:
        self._introduced.pop(key, None)
        self._claims.pop(key, None)
        self._emit(UnitsTaken(name))
        self._emit(PeerLeft(key, name, reason))

    # Reaching peers by name

    def offered_streams(self) -> frozenset[str]:
        """The streams that peers may read."""
        snapshot, policy = self._snapshot(), self._policy()
        return frozenset(
            name
            for component in snapshot.components
            for name in objects_of(snapshot.host, component, policy.offer(component))
        )

    def names(self) -> tuple[str, ...]:
        """The peers that are there."""
        return tuple(sorted(one.name for one in self._introduced.values()))

    def key_of(self, host: str) -> PeerKey | None:
        """The key of the peer of that name, if it is there."""
        return next((key for key, one in self._introduced.items() if one.name == host), None)

    def call(self, host: str, method: str, args: Body, *, deadline_s: float) -> Call:
        """Call a peer. Raises `PeerUnreachable` (PEER_DOWN, PEER_BUSY), `ProtocolViolation`."""
        return self._fleet.call(self._present(host), method, args, deadline_s=deadline_s)

    def notify(self, host: str, method: str, args: Body) -> None:
        """Tell a peer something. Raises as `call` does."""
        self._fleet.notify(self._present(host), method, args)

    def _present(self, host: str) -> PeerKey:
        key = self.key_of(host)
        if key is None:
            raise PeerUnreachable(Problem("PEER_DOWN", "there is no link to the peer", where=host))
        return key
