"""All that the component manager decides from, as one frozen value; the catalogue keeps it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from nondum.host.core import payload_key
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.data import DataRecord
from nondum.host.core.records.device import DeviceRecord, KnownDevice
from nondum.host.core.records.drive import DriveRecord
from nondum.host.core.records.goal import GoalRecord
from nondum.host.core.records.mount import MountPose
from nondum.host.core.records.payload import FormerPayload, PayloadRecord, Rollback
from nondum.host.core.records.peer import PeerRecord
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.snapshot import Snapshot
from nondum.planning.merge.given_names import GivenNames
from nondum.sdk.frozen import frozen


@frozen
class Highwater:
    """The newest release of a payload that was ever active here; kept for ever."""

    release: int
    digest: str
    owner: str = ""
    """The role of the trust file by which it was the first to come in; empty: none was asked."""


@frozen
class HostState:
    """A host at one moment. Mappings are by id (payloads by key) and are never changed in place."""

    host: str
    revision: int = 0
    drives: Mapping[str, DriveRecord] = field(default_factory=dict)
    payloads: Mapping[str, PayloadRecord] = field(default_factory=dict)
    components: Mapping[str, ComponentRecord] = field(default_factory=dict)
    devices: Mapping[str, DeviceRecord] = field(default_factory=dict)
    known_devices: Mapping[str, KnownDevice] = field(default_factory=dict)
    """Identity → a device that was ever here, as far as is remembered; last seen last."""
    mounts: Mapping[str, MountPose] = field(default_factory=dict)
    connections: Mapping[str, str] = field(default_factory=dict)
    """Name of an optional input → the stream that a person has connected to it."""
    highwater: Mapping[str, Highwater] = field(default_factory=dict)
    """Payload id → newest release, for whatever fleet it was."""
    names: Mapping[str, GivenNames] = field(default_factory=dict)
    """Payload id → what of it has another name here than its own; kept until it is forgotten."""
    rollbacks: Mapping[str, Rollback] = field(default_factory=dict)
    """Payload id → the earlier release that a person went back to."""
    goals: Mapping[str, GoalRecord] = field(default_factory=dict)
    """Those that are not over."""
    former: Mapping[str, FormerPayload] = field(default_factory=dict)
    """Key → what is remembered of a payload, those that left first first; none is active."""
    tries: Mapping[str, int] = field(default_factory=dict)
    """Drive or payload key → how many daemons in a row died while they were at it."""
    is_stopped: bool = False
    """Whether the daemon that wrote this ended because it was told to."""
    data: Mapping[str, DataRecord] = field(default_factory=dict)
    """Id → data that active payloads bring. Not kept when the daemon ends: the next one has them
    when their payloads are active again."""
    peers: Mapping[str, PeerRecord] = field(default_factory=dict)
    """Key → a peer that is there. Not kept either: the next daemon looks again."""
    safety: Safety = Safety.OFF
    """Which payloads are left alone. Not kept either: each daemon finds that out as it starts."""

    @property
    def is_at_work(self) -> bool:
        """Whether it has something to do, or may have at any moment: for a goal, or for a peer."""
        return bool(self.goals or self.peers)

    def key_of(self, digest: str) -> str:
        """What this host calls, or would call, a payload, by the digest of its contents list."""
        return self.keys().get(digest, payload_key.key_of(digest))

    def keys(self) -> dict[str, str]:
        """Digest of a contents list → key of the payload that is here."""
        return {one.digest: one.key for one in self.payloads.values() if one.digest}

    def snapshot(self) -> Snapshot:
        """The state as readers get it."""
        return Snapshot(
            host=self.host,
            revision=self.revision,
            components=tuple(sorted(self.components.values(), key=lambda c: (c.rank, c.id))),
            payloads=tuple(self.payloads.values()),
            drives=tuple(self.drives.values()),
            devices=tuple(self.devices.values()),
            data=tuple(sorted(self.data.values(), key=lambda d: (d.name, d.id))),
            known_devices=tuple(self.known_devices.values()),
            mounts=tuple(self.mounts.values()),
            connections=tuple(sorted(self.connections.items())),
            rollbacks=tuple(rollback.digest for rollback in self.rollbacks.values()),
            goals=tuple(self.goals.values()),
            former=tuple(self.former.values()),
            peers=tuple(sorted(self.peers.values(), key=lambda p: p.name)),
            names=self.names,
            safety=self.safety,
            tries=self.tries,
        )
