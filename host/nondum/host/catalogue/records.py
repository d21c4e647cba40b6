"""What the catalogue holds, as frozen values: the only form in which it leaves the catalogue."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem

Xyz = tuple[float, float, float]


class ComponentState(Enum):
    """How a component of an active payload is."""

    READY = "ready"
    """Its worker runs and answers."""
    RESTARTING = "restarting"
    """Its worker ended; supervision starts it again."""
    QUARANTINED = "quarantined"
    """Its worker failed too often; it waits for a replug or a person."""


@dataclass(frozen=True, slots=True)
class MountPose:
    """Where a unit sits in its host's body frame (REP-103: x forward, y left, z up)."""

    unit: str
    """Full object name; also the frame's name."""
    xyz: Xyz
    """Metres."""
    rpy: Xyz
    """Roll, pitch, yaw in radians."""
    origin: str
    """`person` (set on this host; outlives the component), `payload` (its default) or `unknown`."""


@dataclass(frozen=True, slots=True)
class DeviceRecord:
    """A device that is plugged in, wanted or not."""

    id: str
    node: Path
    properties: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class DeviceClaim:
    """A declared need of a component and the device that serves it, if one is there."""

    name: str
    match: Mapping[str, str]
    optional: bool
    device: str | None = None
    """Id of a `DeviceRecord`."""
    contested_by: tuple[str, ...] = ()
    """Components that want the same device and did not get it."""


@dataclass(frozen=True, slots=True)
class ComponentRecord:
    """A component of an active payload."""

    id: str
    payload: str
    """Key of its payload."""
    payload_id: str
    distribution: str
    entry_point: str
    """`module:attribute` or `module`."""
    version: str
    state: ComponentState
    description: PluginDescription
    venv: Path
    site_packages: Path
    scratch: Path
    rank: int
    """Order of arrival on this host, initial components first: the lower, the more it counts."""
    permissions: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    devices: tuple[DeviceClaim, ...] = ()
    problems: tuple[Problem, ...] = ()

    @property
    def is_ready(self) -> bool:
        """Whether its worker answers and every required device is there."""
        return self.state is ComponentState.READY and all(
            claim.device is not None or claim.optional for claim in self.devices
        )


@dataclass(frozen=True, slots=True)
class Moment:
    """When something happened, by both clocks."""

    monotonic_s: float
    """Seconds since boot, for durations."""
    wall_s: float
    """Seconds since the epoch, for people."""


@dataclass(frozen=True, slots=True)
class DriveRecord:
    """A drive that is in."""

    id: str
    kind: str
    root: Path
    problems: tuple[Problem, ...] = ()


@dataclass(frozen=True, slots=True)
class PayloadRecord:
    """A payload that this host knows of now: on a drive, or installed."""

    key: str
    digest: str
    payload_id: str
    version: str
    release: int
    fleet: str
    step: str
    """Name of its step in the component manager's state machine."""
    drives: tuple[str, ...]
    """Where it is; `installed` among them means for good."""
    attempts: int
    phases: Mapping[str, Moment]
    """`seen`, `verified`, `installed`, `ready` → when, as far as it has come."""
    components: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The catalogue at one revision."""

    host: str
    revision: int
    components: tuple[ComponentRecord, ...] = ()
    """By rank."""
    payloads: tuple[PayloadRecord, ...] = ()
    drives: tuple[DriveRecord, ...] = ()
    devices: tuple[DeviceRecord, ...] = ()
    mounts: tuple[MountPose, ...] = ()

    def component(self, id: str) -> ComponentRecord | None:
        """The component of that id, if it is active."""
        return next((c for c in self.components if c.id == id), None)

    def ready(self) -> Iterator[ComponentRecord]:
        """Components that may act now."""
        return (c for c in self.components if c.is_ready)

    def mount(self, unit: str) -> MountPose | None:
        """The pose of a unit's frame in the body frame, where it is known."""
        return next((m for m in self.mounts if m.unit == unit), None)


@dataclass(frozen=True, slots=True)
class JournalEntry:
    """One line of the journal."""

    id: int
    at: Moment
    boot: str
    """Which run of the daemon wrote it."""
    event: str
    """Name of the event."""
    subject: str
    """Payload id, component, device, drive or goal that it is about."""
    step: str = ""
    """The step that the payload came to, where there is one."""
    problems: tuple[Problem, ...] = ()
    detail: Mapping[str, Any] = field(default_factory=dict)


def object_name(host: str, component: str, local: str) -> str:
    """Full name of a unit or of an output slot's stream.

    >>> object_name("panther", "front-camera", "camera")
    'panther__front-camera__camera'
    """
    return f"{host}__{component}__{local}"
