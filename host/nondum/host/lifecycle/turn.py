"""One event and all that follows from it, gathered before anything is written down or done."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, TypeVar

from nondum.host.core.effects import Effect
from nondum.host.core.events.event import Event
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.drive import DriveRecord
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.peer import PeerRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle.former_payloads import remembering, remembering_peer

_V = TypeVar("_V")


class Outcome(NamedTuple):
    """What an event came to."""

    state: HostState
    effects: tuple[Effect, ...]
    """What is to be done now."""
    events: tuple[Event, ...]
    """The event and its consequences; empty: it meant nothing any more."""


@dataclass(slots=True)
class Turn:
    """What one event changes; lives only while `advance` runs."""

    state: HostState
    at: Moment
    effects: list[Effect] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    """The event and its consequences, in order: what the journal is told."""
    pending: list[Event] = field(default_factory=list)
    """Consequences that were not looked at yet."""
    missed: frozenset[str] = frozenset()
    """Drives that are not there as a daemon starts: pulled, or not looked for long enough."""

    def outcome(self) -> Outcome:
        """What it came to."""
        return Outcome(self.state, tuple(self.effects), tuple(self.events))

    def change(self, **fields: Any) -> None:
        """Replace fields of the state."""
        self.state = replace(self.state, **fields)

    def put_drive(self, drive: DriveRecord) -> None:
        """Enter or replace a drive."""
        self.change(drives=_with(self.state.drives, drive.id, drive))

    def put_payload(self, payload: PayloadRecord) -> None:
        """Enter or replace a payload; one that is gone is dropped."""
        if payload.step is Step.GONE:
            self.change(payloads=_without(self.state.payloads, payload.key))
        else:
            self.change(payloads=_with(self.state.payloads, payload.key, payload))

    def put_component(self, component: ComponentRecord) -> None:
        """Enter or replace a component."""
        self.change(components=_with(self.state.components, component.id, component))

    def drop_drive(self, drive: str) -> None:
        """Forget a drive."""
        self.change(drives=_without(self.state.drives, drive))

    def drop_components(self, payload: str) -> None:
        """Withdraw a payload's components and data, and the mounts that only it had said; what they
        could do is remembered."""
        gone = {id: c for id, c in self.state.components.items() if c.payload == payload}
        mounts = {
            unit: pose
            for unit, pose in self.state.mounts.items()
            if pose.origin == "person" or unit.split("__")[1] not in gone
        }
        kept = {id: c for id, c in self.state.components.items() if id not in gone}
        data = {id: d for id, d in self.state.data.items() if d.payload != payload}
        self.change(components=kept, mounts=mounts, data=data)
        if gone:
            self._remember(self.state.payloads[payload], gone.values())

    def put_peer(self, peer: PeerRecord) -> None:
        """Enter or replace a peer; what it offers no more is remembered."""
        self._remember_peer(peer)
        back = {f"{c.payload_id}@{peer.name}" for c in peer.components}
        former = {key: one for key, one in self.state.former.items() if key not in back}
        self.change(peers=_with(self.state.peers, peer.key, peer), former=former)

    def drop_peer(self, key: str) -> None:
        """Withdraw a peer; what it offered is remembered."""
        self._remember_peer(replace(self.state.peers[key], components=()))
        self.change(peers=_without(self.state.peers, key))

    def forget(self, key: str) -> None:
        """Remember nothing of a payload that was here."""
        self.change(former=_without(self.state.former, key))

    def _remember_peer(self, now: PeerRecord) -> None:
        """Keep what a peer offered until now."""
        before = self.state.peers.get(now.key)
        offered = {component.id for component in now.components}
        gone = [c for c in before.components if c.id not in offered] if before else []
        if gone:
            kept = remembering_peer(self.state.former, now.name, gone, self.at.wall_s)
            self.change(former=kept)

    def _remember(self, payload: PayloadRecord, gone: Iterable[ComponentRecord]) -> None:
        """Keep what a payload could do, unless it is still here in another version."""
        if all(c.payload_id != payload.payload_id for c in self.state.components.values()):
            kept = remembering(self.state.former, payload, gone, self.at.wall_s)
            self.change(former=kept)


def _with(mapping: Mapping[str, _V], key: str, value: _V) -> dict[str, _V]:
    return {**mapping, key: value}


def _without(mapping: Mapping[str, _V], key: str) -> dict[str, _V]:
    return {k: v for k, v in mapping.items() if k != key}
