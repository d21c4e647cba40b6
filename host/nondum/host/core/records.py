"""What the catalogue holds, as frozen values: the only form in which it leaves the catalogue."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

from nondum.planning.merge.given_names import GivenNames
from nondum.planning.merge.goal import GoalKind
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.sdk.signature import parse_signature

Xyz = tuple[float, float, float]


INSTALLED = "installed"
"""Kind of the drives that stand for initial components: no source watches them."""


class Step(Enum):
    """How far a payload has come on this host. `transitions.py` says what leads where."""

    RECEIVED = "received"
    """Its contents list was read; what this host needs of it is being copied to staging."""
    COPIED = "copied"
    """Each file that is needed lies in staging, hashed on the way; they are being checked."""
    VERIFIED = "verified"
    """Manifest, locks, index and wheels are sound and fit this host."""
    STAGED = "staged"
    """The checked copy is in its lasting place; the wheels are being unpacked into the store."""
    STORED = "stored"
    """All wheels are in the store and venvs linked from it; workers are asked what they are."""
    PROBED = "probed"
    """Each worker runs and said what the index says."""
    ACTIVE = "active"
    """Its components are in the catalogue and may act."""
    SUPERSEDED = "superseded"
    """Another release of it is active, or is tried first; it waits, installed, to come back."""
    REMOVING = "removing"
    """Withdrawn; its processes end and its files are deleted."""
    REFUSED = "refused"
    """It is not what it claims, or does not fit this host: nothing of it was kept."""
    QUARANTINED = "quarantined"
    """It could not be brought to life; it waits for a replug or a person."""
    GONE = "gone"
    """Not on this host, or not any more."""


class Safety(Enum):
    """Which payloads a daemon leaves alone, since daemons before it died, or a person says so."""

    OFF = "off"
    """None: it is as always."""
    INITIAL = "initial"
    """What drives and other hosts bring: only what was installed for good may be at work."""
    NOTHING = "nothing"
    """All of them."""


class DriveState(Enum):
    """How far a drive has been read."""

    READING = "reading"
    """It is being looked through."""
    COPYING = "copying"
    """All its payloads are known; some are still being copied."""
    IDLE = "idle"
    """Nothing is wanted of it any more; it is unmounted and safe to pull."""


class ComponentState(Enum):
    """How a component of an active payload is."""

    READY = "ready"
    """Its worker runs and answers."""
    RESTARTING = "restarting"
    """Its worker ended; supervision starts it again."""
    QUARANTINED = "quarantined"
    """Its worker failed too often; it waits for a replug or a person."""


@dataclass(frozen=True, slots=True)
class Moment:
    """When something happened, by both clocks."""

    monotonic_s: float
    """Seconds since boot, for durations."""
    wall_s: float
    """Seconds since the epoch, for people."""


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
    """`person` (set on this host; outlives the component) or `payload` (its default)."""


@dataclass(frozen=True, slots=True)
class DeviceNode:
    """What is opened to use a device, or a part of it."""

    node: Path
    properties: Mapping[str, str]
    """udev's, and those of its interface and device by which it is identified."""
    interface: str = ""
    """Number of the USB interface that it belongs to: `00`; empty: of the device as a whole."""

    @property
    def subsystem(self) -> str:
        """The kernel's kind of node."""
        return self.properties.get("SUBSYSTEM", "")


@dataclass(frozen=True, slots=True)
class DeviceInterface:
    """One of the functions of a USB device."""

    number: str
    kind: str
    """Class, subclass and protocol in hexadecimal: `03:01:02`."""
    driver: str = ""
    """The kernel's; empty: none."""


@dataclass(frozen=True, slots=True)
class DeviceRecord:
    """A physical device that is plugged in, wanted or not, with all its nodes."""

    id: str
    """Bus and port, `usb:1-4.2`, or the name of its slot file."""
    nodes: tuple[DeviceNode, ...]
    """At least one, those that drivers made first, the raw one of a USB device last."""
    bus: str = ""
    port: str = ""
    parent: str = ""
    """Id of the device that it is plugged into, where that is a USB device."""
    interfaces: tuple[DeviceInterface, ...] = ()
    driver: str = ""
    """The kernel's drivers of it and its interfaces."""
    vendor: str = ""
    """Hexadecimal, of USB devices."""
    product: str = ""
    serial: str = ""
    name: str = ""
    """What it, or udev's database, says that it is."""
    first_s: float = 0.0
    """When such a device was first seen on this host, in seconds since 1970."""
    since_s: float = 0.0
    """When it was plugged in, or the daemon started."""

    @property
    def identity(self) -> str:
        """What it is known by when it comes again, at another port too if it has a number."""
        if not self.vendor:
            return self.id
        kind = f"{self.bus} {self.vendor}:{self.product}"
        return f"{kind} {self.serial}" if self.serial else f"{kind} at {self.port}"


@dataclass(frozen=True, slots=True)
class KnownDevice:
    """A device that was seen on this host, whether it is there or not."""

    identity: str
    name: str
    device: str
    """Id that it had when last seen."""
    first_s: float
    last_s: float
    """When it was last plugged in or pulled, in seconds since 1970."""


@dataclass(frozen=True, slots=True)
class DeviceClaim:
    """A declared need of a component and the device that serves it, if one is there."""

    name: str
    match: Mapping[str, str]
    optional: bool
    device: str | None = None
    """Id of a `DeviceRecord`."""
    nodes: tuple[Path, ...] = ()
    """Its nodes that serve the need, the first of them first."""
    contested_by: tuple[str, ...] = ()
    """Components that want the same device and did not get it."""


@dataclass(frozen=True, slots=True)
class ComponentRecord:
    """A component of an active payload."""

    id: str
    """Its name on this host: the id in its manifest, unless another payload has one of that id."""
    payload: str
    """Key of its payload."""
    payload_id: str
    distribution: str
    entry_point: str
    """`module:attribute` or `module`."""
    version: str
    state: ComponentState
    description: PluginDescription
    """What its plugin says, under the plugin's name on this host."""
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
    def abilities(self) -> tuple[str, ...]:
        """The names of its behaviours."""
        return tuple(behaviour.name for behaviour in self.description.behaviours)

    @property
    def is_ready(self) -> bool:
        """Whether its worker answers and every required device is there."""
        return self.state is ComponentState.READY and not self.missing_devices

    @property
    def missing_devices(self) -> tuple[str, ...]:
        """The names of its needs that no device serves, and that it does not act without."""
        claims = (claim for claim in self.devices if not claim.optional)
        return tuple(claim.name for claim in claims if claim.device is None)


@dataclass(frozen=True, slots=True)
class PeerComponent:
    """What a peer offers this host of one of its components."""

    id: str
    """Its id here, `component@host`."""
    life: str
    """Names the run of its host: a component that comes back after that ended is another one."""
    payload_id: str
    version: str
    description: PluginDescription
    is_ready: bool
    rank: int
    """Below all of this host's own."""
    withheld: tuple[str, ...] = ()
    """Its units that this host may not use."""

    @property
    def abilities(self) -> tuple[str, ...]:
        """The names of the behaviours that this host may ask for."""
        types = {unit.type for unit in self.description.units}
        return tuple(
            behaviour.name
            for behaviour in self.description.behaviours
            if not self.withheld or types & set(parse_signature(behaviour.action).actor.types)
        )

    @property
    def payload(self) -> str:
        """Tells it from another component of that id, as payload keys do at home."""
        return f"{self.life} {self.version}"


@dataclass(frozen=True, slots=True)
class PeerRecord:
    """A peer that is there, and what it shares."""

    key: str
    """Its public key."""
    name: str
    address: str
    admitted_by: str
    """`pairing`, `certificate` or `development`."""
    life: str
    """Names its run: another one after it was started again."""
    components: tuple[PeerComponent, ...] = ()
    mounts: tuple[MountPose, ...] = ()
    devices: Mapping[str, str] = field(default_factory=dict)
    """Device → the component that has it."""
    compute: Mapping[str, Any] = field(default_factory=dict)
    """`machine`, `python`, `processors`, `memory_mb`, `gpu_memory_mb` …, see `peers.compute`."""
    problems: tuple[Problem, ...] = ()
    """What it said that could not be understood."""


@dataclass(frozen=True, slots=True)
class DriveRecord:
    """A drive that is in."""

    id: str
    kind: str
    """`slot`, `block`, `installed` or `placed`."""
    root: Path
    node: Path | None = None
    """Block device to mount at `root`, where there is one."""
    filesystem: str = ""
    state: DriveState = DriveState.READING
    since: Moment = Moment(0.0, 0.0)
    """When it was inserted."""
    problems: tuple[Problem, ...] = ()
    mark: str = ""
    """What it is by its own word, whenever it is plugged in; empty: it has none."""


@dataclass(frozen=True, slots=True)
class PayloadRecord:
    """A payload that this host knows of now: on a drive, or installed."""

    key: str
    digest: str
    payload_id: str
    version: str
    release: int
    fleet: str
    step: Step
    sources: Mapping[str, Path]
    """Drive → the payload's folder on it."""
    phases: Mapping[str, Moment]
    """`seen`, `verified`, `installed`, `ready` → when, as far as it has come."""
    components: tuple[str, ...] = ()
    """By their names on this host; empty until it was verified."""
    renamed: Mapping[str, str] = field(default_factory=dict)
    """Id in its manifest → name on this host, of those components where that is another."""
    problems: tuple[Problem, ...] = ()
    was: int = 0
    """The release that it took over from when it last became active; 0: none."""

    @property
    def drives(self) -> tuple[str, ...]:
        """Where it is, by name."""
        return tuple(sorted(self.sources))

    @property
    def names(self) -> dict[str, str]:
        """Id in its manifest → name on this host, of each component."""
        ids = {name: id for id, name in self.renamed.items()}
        return {ids.get(name, name): name for name in self.components}


@dataclass(frozen=True, slots=True)
class Rollback:
    """A person wants an earlier release of a payload to be active."""

    digest: str
    """The release that is to be."""
    release: int
    below: int
    """The newest release that it goes before; a newer one counts again."""


@dataclass(frozen=True, slots=True)
class GoalRecord:
    """A goal that was given and is not over: a daemon that starts takes it up again."""

    id: str
    text: str
    """As the person gave it."""
    pddl: str
    kind: GoalKind
    priority: int


@dataclass(frozen=True, slots=True)
class FormerPayload:
    """A payload that was active here and is gone: what it could do, so that it can be named when
    something is missing. Nothing of it runs, and none of its files are kept by this."""

    payload_id: str
    version: str
    components: Mapping[str, PluginDescription]
    """Id → what the component said of itself."""
    left_wall_s: float
    """When it was withdrawn, in seconds since 1970; if that was while no daemon ran, when the next
    one started."""
    size: int
    """Length of `components` as JSON."""
    host: str = ""
    """The peer whose payload it was; empty: this host's."""

    @property
    def key(self) -> str:
        """One memory for each."""
        return f"{self.payload_id}@{self.host}" if self.host else self.payload_id


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
