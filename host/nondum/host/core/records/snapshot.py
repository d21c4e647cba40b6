"""The catalogue at one revision."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field

from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.data import DataRecord
from nondum.host.core.records.device import DeviceRecord, KnownDevice
from nondum.host.core.records.drive import DriveRecord
from nondum.host.core.records.goal import GoalRecord
from nondum.host.core.records.mount import MountPose
from nondum.host.core.records.payload import FormerPayload, PayloadRecord
from nondum.host.core.records.peer import PeerComponent, PeerRecord
from nondum.host.core.records.safety import Safety
from nondum.planning.merge.given_names import GivenNames
from nondum.sdk.frozen import frozen


@frozen
class Snapshot:
    """The catalogue at one revision."""

    host: str
    revision: int
    components: tuple[ComponentRecord, ...] = ()
    """By rank."""
    payloads: tuple[PayloadRecord, ...] = ()
    drives: tuple[DriveRecord, ...] = ()
    devices: tuple[DeviceRecord, ...] = ()
    data: tuple[DataRecord, ...] = ()
    known_devices: tuple[KnownDevice, ...] = ()
    """Those that were here, whether they are or not; last seen last."""
    mounts: tuple[MountPose, ...] = ()
    connections: tuple[tuple[str, str], ...] = ()
    """Optional inputs, and the streams that people have connected to them."""
    rollbacks: tuple[str, ...] = ()
    """Digests of the releases that people went back to."""
    goals: tuple[GoalRecord, ...] = ()
    """In the order they were given."""
    former: tuple[FormerPayload, ...] = ()
    """Those that left first come first."""
    peers: tuple[PeerRecord, ...] = ()
    """By name."""
    safety: Safety = Safety.OFF
    tries: Mapping[str, int] = field(default_factory=dict)
    """What daemons died at, as `lifecycle/crash_attribution.py` counts it."""
    names: Mapping[str, GivenNames] = field(default_factory=dict)
    """Payload id → what of it has another name here than its own."""

    def everyone(self) -> Iterator[tuple[str, ComponentRecord | PeerComponent]]:
        """Each component, this host's own first, with the name of its host."""
        for component in self.components:
            yield self.host, component
        for peer in self.peers:
            for offered in peer.components:
                yield peer.name, offered

    def peer(self, name: str) -> PeerRecord | None:
        """The peer of that name, if it is there."""
        return next((peer for peer in self.peers if peer.name == name), None)

    def component(self, id: str) -> ComponentRecord | None:
        """The component of that id, if it is active."""
        return next((c for c in self.components if c.id == id), None)

    def ready(self) -> Iterator[ComponentRecord]:
        """Components that may act now."""
        return (c for c in self.components if c.is_ready)

    def mount(self, unit: str) -> MountPose | None:
        """The pose of a unit's frame in the frame of its body, where it is known."""
        every = (self.mounts, *(peer.mounts for peer in self.peers))
        return next((m for mounts in every for m in mounts if m.unit == unit), None)
