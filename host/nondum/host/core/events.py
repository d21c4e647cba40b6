"""What has happened on a host: frozen values in past tense, the only news that travels inside it.

Sources (drives, devices, workers, people) emit events; the component manager turns them into new
state and effects; executors report back with events again. An event that tells of recomposition
is journalled; those that only tell how the world looks, many a second, are not.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

from nondum.host.core.plain import plain
from nondum.host.core.records import ComponentRecord, DeviceRecord, MountPose, PeerRecord
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.wheelhouse.format.signatures import NOTHING, Grant


@dataclass(frozen=True, slots=True)
class Event:
    """Anything that has happened."""

    JOURNALLED: ClassVar[bool] = True
    """Whether the journal keeps it."""

    @property
    def name(self) -> str:
        """The event's name as the journal writes it: `DriveInserted`."""
        return type(self).__name__

    def to_dict(self) -> dict[str, Any]:
        """Plain data for the journal and for people's tools."""
        pairs = ((f.name, getattr(self, f.name)) for f in dataclasses.fields(self))
        return {key: plain(value) for key, value in pairs}


Emit: TypeAlias = Callable[[Event], None]
"""Passes an event on; never blocks, called on the loop's thread."""


# Drives


@dataclass(frozen=True, slots=True)
class DriveInserted(Event):
    """A drive is there: a slot's entry or a block device."""

    drive: str
    """Name of this insertion: `slot-a`, `sdb1`."""
    root: Path
    """Where its files are, or will be once `node` is mounted there."""
    kind: str
    """`slot`, `block`, `installed` or `placed`."""
    node: Path | None = None
    """The block device to mount at `root`; None: `root` is readable as it is."""
    filesystem: str = ""
    """File system of `node`, as udev names it."""
    problems: tuple[Problem, ...] = ()
    """What keeps it from being read at all."""
    port: str = ""
    """Where it is plugged in, as far as that is known: whatever comes there next has the same."""
    mark: str = ""
    """What it says that it is, the same after the machine has started again; empty: nothing."""


@dataclass(frozen=True, slots=True)
class DriveQueued(Event):
    """A drive waits until others have been looked through."""

    JOURNALLED: ClassVar[bool] = False
    drive: str
    ahead: int
    """How many come before it; 0: its turn has come."""


@dataclass(frozen=True, slots=True)
class DriveFlapping(Event):
    """Something comes and goes in a port, so that it is not read before it has stayed a while."""

    drive: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class DriveLeftAlone(Event):
    """A disk that could be plugged in is this machine's own: it is never read."""

    drive: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class DriveRemoved(Event):
    """A drive was pulled, or its source says that it is not there."""

    drive: str


@dataclass(frozen=True, slots=True)
class DriveRead(Event):
    """A drive has been looked through; `payloads` (keys) are all that it carries."""

    drive: str
    payloads: tuple[str, ...]
    certificates: int = 0
    """How many certificates of hosts it carries."""
    trust_files: int = 0
    """How many versions of trust files it carries."""
    flaws: tuple[Problem, ...] = ()
    """What is on it, and is not taken."""


@dataclass(frozen=True, slots=True)
class DriveReleased(Event):
    """A drive was let go of: nothing of it is mounted, and nothing is read from it."""

    JOURNALLED: ClassVar[bool] = False
    drive: str


@dataclass(frozen=True, slots=True)
class DriveUnreadable(Event):
    """A drive could not be mounted or looked through, or carries no payload."""

    drive: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class DrivesScanned(Event):
    """The source of one kind of drives has told every drive that was there when it started."""

    kind: str
    drives: tuple[str, ...]


# Payloads


@dataclass(frozen=True, slots=True)
class PayloadFound(Event):
    """A payload folder was seen on a drive and its contents list read, once."""

    payload: str
    """Key of the payload on this host: the first 16 hex digits of `digest`."""
    drive: str
    folder: Path
    digest: str
    """SHA-256 of the contents list; the payload's identity."""
    payload_id: str
    version: str
    release: int
    fleet: str = ""
    problems: tuple[Problem, ...] = ()
    """What is already known to be wrong with it."""
    warnings: tuple[Problem, ...] = ()
    """What is doubtful about it, and does not keep it out."""
    signers: tuple[str, ...] = ()
    """Names or fingerprints of those who signed it."""
    grant: Grant = NOTHING
    """What it may have, if it is believed."""
    built: str = ""
    """When, as its signers say: UTC, ISO 8601."""


@dataclass(frozen=True, slots=True)
class PayloadCopied(Event):
    """What this host needs of the payload lies in staging, each file as its hash says."""

    payload: str
    bytes_copied: int = 0
    bytes_known: int = 0
    """Bytes of wheels that the store had already, so that they were not copied."""


@dataclass(frozen=True, slots=True)
class PayloadVerified(Event):
    """Manifest, locks, index and wheels were checked, and they fit this host."""

    payload: str
    components: tuple[str, ...]
    """Ids of the components that it brings, as its manifest has them."""
    index: Mapping[str, PluginDescription] = field(default_factory=dict, repr=False)
    """Component id → what its plugin says."""

    def to_dict(self) -> dict[str, Any]:
        """Only names: what the components are stands in the catalogue once it is active."""
        return {"payload": self.payload, "components": list(self.components)}


@dataclass(frozen=True, slots=True)
class PayloadStaged(Event):
    """The checked copy is in its lasting place; the drive is not needed any more."""

    payload: str


@dataclass(frozen=True, slots=True)
class WheelsStored(Event):
    """Every wheel of the payload is in the store, unpacked and safe on disk."""

    payload: str
    fresh: int
    """How many were not in the store before."""


@dataclass(frozen=True, slots=True)
class ComponentsProbed(Event):
    """Every component's venv was made and its worker said what `index.json` says."""

    payload: str


@dataclass(frozen=True, slots=True)
class PayloadActivated(Event):
    """The payload's components are ready to be entered in the catalogue."""

    payload: str
    components: tuple[ComponentRecord, ...] = field(repr=False)
    """Their ranks are given as they are entered."""
    mounts: tuple[MountPose, ...] = ()
    """Where their units sit, as the payload says."""
    grant: Grant = NOTHING
    """What it may have."""
    goals: tuple[str, ...] = ()
    """What it wants, in words."""

    def to_dict(self) -> dict[str, Any]:
        """Only names: what the components are stands in the catalogue."""
        told = {"payload": self.payload, "components": [c.id for c in self.components]}
        return {**told, "goals": list(self.goals)} if self.goals else told


@dataclass(frozen=True, slots=True)
class PayloadRefused(Event):
    """The payload is not what it claims, or does not fit this host."""

    payload: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class PayloadFailed(Event):
    """The payload's components could not be brought to life."""

    payload: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class PayloadDistrusted(Event):
    """A payload that is here is not trusted any more: its key was revoked, say. It is withdrawn."""

    payload: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class PayloadDoubted(Event):
    """A payload that is here is not trusted any more, and stays all the same; or, without
    `problems`, is trusted again."""

    payload: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class TrustRead(Event):
    """A daemon that starts has read and verified the trust file that it goes by."""

    owner: str
    version: int
    first: str
    """Who vouches for the first one, in words: `nondum.host.trust.anchors.Origin`."""


@dataclass(frozen=True, slots=True)
class TrustChanged(Event):
    """Another version of the trust file is active, and safe on disk."""

    owner: str
    version: int
    source: str
    """The drive that brought it, or `person`."""


@dataclass(frozen=True, slots=True)
class TrustFileRefused(Event):
    """A trust file was not taken; the active one stays."""

    source: str
    """The drive that brought it."""
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class ClockDoubted(Event):
    """The wall clock shows a moment that is certainly past."""

    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class ClockRight(Event):
    """The wall clock, which was doubted, may be right again."""


@dataclass(frozen=True, slots=True)
class PayloadWithdrawn(Event):
    """The payload's last source is gone: nothing of it may be used from now on."""

    payload: str
    reason: str
    rebuilt_as: str = ""
    """Key of the payload that was built in its place."""


@dataclass(frozen=True, slots=True)
class PayloadSentAway(Event):
    """A person wants the payload on another host: it leaves this one, and its drive stays in."""

    payload: str
    host: str
    """The other one."""
    problems: tuple[Problem, ...]
    """What is told of it here from now on."""


@dataclass(frozen=True, slots=True)
class BesideRefused(Event):
    """A release cannot run beside the active one, which has to stop first."""

    payload: str
    reason: str


@dataclass(frozen=True, slots=True)
class PayloadSuperseded(Event):
    """Another release of the payload is active or becomes active; this one waits beside it."""

    payload: str
    by: str
    """Key of the other one."""
    reason: str


@dataclass(frozen=True, slots=True)
class PayloadResumed(Event):
    """A release that waited beside another one is wanted: it is brought up (again)."""

    payload: str
    reason: str


@dataclass(frozen=True, slots=True)
class RollbackAsked(Event):
    """A person asked for an earlier release of a payload, this once: rollback protection lets it
    pass until it is unplugged or a newer one comes."""

    payload: str
    """Key of the earlier release."""
    release: int
    from_release: int


@dataclass(frozen=True, slots=True)
class PayloadPlaced(Event):
    """A payload that does not run here runs on a peer now."""

    payload: str
    host: str
    """The peer."""
    why: str


@dataclass(frozen=True, slots=True)
class PlaceLost(Event):
    """A payload does not run any more on the peer that it was placed on."""

    payload: str
    host: str
    """The peer."""
    reason: str


@dataclass(frozen=True, slots=True)
class PlaceMissing(Event):
    """No peer that is there takes a payload that does not run here."""

    payload: str
    problems: tuple[Problem, ...]
    """What each of them has said, `where` its name."""


@dataclass(frozen=True, slots=True)
class PayloadTaken(Event):
    """A peer's payload runs here, since it does not run there."""

    payload: str
    host: str
    """The peer."""
    why: str


@dataclass(frozen=True, slots=True)
class PayloadCleared(Event):
    """Nothing of the payload runs, and its venvs, staging and folder are gone."""

    payload: str


@dataclass(frozen=True, slots=True)
class RetryAsked(Event):
    """A refused or quarantined payload is to be tried again: a person asked for it, or the host
    does by itself."""

    payload: str
    why: str = ""
    """Why the host does; empty: a person asked."""


@dataclass(frozen=True, slots=True)
class ForgetAsked(Event):
    """A person asked that a payload that is gone be forgotten."""

    payload: str
    """Its id: there is no key of what is gone."""


@dataclass(frozen=True, slots=True)
class Recovered(Event):
    """A payload was found half done when the daemon started, and sent forward or back."""

    payload: str
    found: str
    """The step that it was found at."""


@dataclass(frozen=True, slots=True)
class HostStarted(Event):
    """The daemon is up; `recovered` says what it found half done and did about it."""

    host: str
    recovered: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class HostStopped(Event):
    """The daemon was told to end, and did."""

    host: str


@dataclass(frozen=True, slots=True)
class SafeModeEntered(Event):
    """The daemon leaves payloads alone, as it has started."""

    host: str
    problems: tuple[Problem, ...]
    """Which, and why."""


@dataclass(frozen=True, slots=True)
class SafeModeLeft(Event):
    """Payloads are taken in again: a person asked for it, or the host does by itself."""

    host: str
    why: str = ""
    """Why the host does; empty: a person asked."""


@dataclass(frozen=True, slots=True)
class TrialDue(Event):
    """The daemon has lived long enough to try again something that others died of."""

    JOURNALLED: ClassVar[bool] = False

    host: str


@dataclass(frozen=True, slots=True)
class DriveRetried(Event):
    """A drive that was left alone is to be looked at: a person asked for it, or the host does by
    itself."""

    drive: str
    why: str = ""
    """Why the host does; empty: a person asked."""


@dataclass(frozen=True, slots=True)
class HostStable(Event):
    """The daemon has lived for a while beside what others had died of."""

    host: str


@dataclass(frozen=True, slots=True)
class CatalogueSetAside(Event):
    """The catalogue's file was damaged or gone: a backup, or a new one, took its place."""

    host: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class CatalogueUnwritten(Event):
    """What happens is not on disk: the host goes on, and writes it as soon as it can."""

    JOURNALLED: ClassVar[bool] = False

    host: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class CatalogueWritten(Event):
    """All that happened is on disk again."""

    host: str


@dataclass(frozen=True, slots=True)
class Recomposed(Event):
    """The catalogue has a new revision: components came, went or changed."""

    revision: int
    reason: str


@dataclass(frozen=True, slots=True)
class ProgressMade(Event):
    """A step of an installation is `done` of `total` through."""

    JOURNALLED: ClassVar[bool] = False
    payload: str
    phase: str
    done: int
    total: int


@dataclass(frozen=True, slots=True)
class WheelsCompiled(Event):
    """Workers of a payload find its modules compiled when they are started again."""

    JOURNALLED: ClassVar[bool] = False
    payload: str


# Workers


@dataclass(frozen=True, slots=True)
class WorkerReady(Event):
    """A worker runs its plugin and has described it."""

    component: str
    description: PluginDescription
    payload: str = ""
    """Key of the payload whose worker it is: two releases may run side by side."""


@dataclass(frozen=True, slots=True)
class WorkerExited(Event):
    """A worker ended or was ended, and will be started again unless a failure follows."""

    component: str
    reason: str
    payload: str = ""
    problem: Problem | None = field(default=None, repr=False)
    """The same as data."""

    def to_dict(self) -> dict[str, Any]:
        """The reason once."""
        return {"component": self.component, "reason": self.reason, "payload": self.payload}


@dataclass(frozen=True, slots=True)
class WorkerStable(Event):
    """A worker that was started again has lived for a while: what was wrong is past."""

    component: str
    payload: str = ""


@dataclass(frozen=True, slots=True)
class ConditionEnded(Event):
    """A condition ended with an error: nothing tells its facts any more."""

    component: str
    condition: str
    problems: tuple[Problem, ...]
    payload: str = ""


@dataclass(frozen=True, slots=True)
class WorkerFailed(Event):
    """A worker will not be started again: it is quarantined."""

    component: str
    problems: tuple[Problem, ...]
    payload: str = ""


@dataclass(frozen=True, slots=True)
class WorkerStrained(Event):
    """A worker uses nearly all that it may, or spins; it goes on. Told again only after a calm."""

    component: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class WorkerFaulted(Event):
    """A worker's plugin made a mistake that is not its end: it goes on. Each is told once."""

    component: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class InputAmbiguous(Event):
    """Several streams fit an optional input, and the configuration does not say which it gets."""

    component: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class TrialFailed(Event):
    """A worker ended that was tried beside the active one: its release does not work."""

    payload: str
    component: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class BehaviourStarted(Event):
    """A behaviour was asked to run."""

    component: str
    behaviour: str
    call_id: int
    arguments: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class BehaviourEstablished(Event):
    """A lasting behaviour's effects begin to hold."""

    component: str
    behaviour: str
    call_id: int


@dataclass(frozen=True, slots=True)
class BehaviourProgressed(Event):
    """A behaviour said how far it is."""

    JOURNALLED: ClassVar[bool] = False
    component: str
    behaviour: str
    call_id: int
    fraction: float
    text: str = ""


@dataclass(frozen=True, slots=True)
class BehaviourEnded(Event):
    """A behaviour ended, however it ended."""

    component: str
    behaviour: str
    call_id: int
    outcome: str
    """`SUCCEEDED`, `FAILED` or `HALTED`."""
    reason: str = ""
    """Why it failed or was halted; what it answered, if it succeeded."""


@dataclass(frozen=True, slots=True)
class BehavioursHalted(Event):
    """A tick of the task tree took behaviours down: all that one decision halted."""

    tick: int
    halted: Mapping[str, str] = field(default_factory=dict)
    """Actions whose behaviours were asked to end → why."""
    lost: Mapping[str, str] = field(default_factory=dict)
    """Actions whose behaviours had ended by themselves or with their component → how."""


@dataclass(frozen=True, slots=True)
class FactKnown(Event):
    """A component says that something is so."""

    JOURNALLED: ClassVar[bool] = False
    component: str
    predicate: str
    arguments: tuple[str, ...]
    value: Any = None
    """`[type, header]` of a valued fact, as it travels."""


@dataclass(frozen=True, slots=True)
class FactForgotten(Event):
    """A component says that something is not so, or not known, any more."""

    JOURNALLED: ClassVar[bool] = False
    component: str
    predicate: str
    arguments: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class StreamFlowing(Event):
    """A stream's first message has gone out, or (not `flowing`) it has ended or stalled."""

    JOURNALLED: ClassVar[bool] = False
    component: str
    stream: str
    """Full object name."""
    flowing: bool


@dataclass(frozen=True, slots=True)
class WorkerLogged(Event):
    """A plugin logged a line."""

    JOURNALLED: ClassVar[bool] = False
    component: str
    level: str
    message: str


# Devices


@dataclass(frozen=True, slots=True)
class DeviceAppeared(Event):
    """A device is there."""

    device: str
    """Its id on this host: bus and port, or the name of its slot file."""
    found: DeviceRecord = field(repr=False)
    """As its source sees it."""

    def to_dict(self) -> dict[str, Any]:
        """Only what it is: all its properties stand in the catalogue."""
        nodes = [str(node.node) for node in self.found.nodes]
        return {"device": self.device, "identity": self.found.identity, "nodes": nodes}


@dataclass(frozen=True, slots=True)
class DeviceChanged(Event):
    """A device that is there has other nodes or properties than before."""

    device: str
    found: DeviceRecord = field(repr=False)
    """As its source sees it now."""

    def to_dict(self) -> dict[str, Any]:
        """Only what it is, as `DeviceAppeared` has it."""
        return DeviceAppeared(self.device, self.found).to_dict()


@dataclass(frozen=True, slots=True)
class DeviceRemoved(Event):
    """A device was pulled."""

    device: str


@dataclass(frozen=True, slots=True)
class DeviceClaimed(Event):
    """A device was given to the component that declared a need for it."""

    device: str
    component: str
    need: str


@dataclass(frozen=True, slots=True)
class DeviceReleased(Event):
    """A component lost a device, or gave it back."""

    device: str
    component: str
    need: str


# Peers


@dataclass(frozen=True, slots=True)
class CertificatesBrought(Event):
    """A drive carries certificates of hosts, this one's perhaps."""

    drive: str
    certificates: tuple[str, ...] = field(repr=False)
    """As they were read: nothing has checked them."""

    def to_dict(self) -> dict[str, Any]:
        """Only how many: anybody can write a drive."""
        return {"drive": self.drive, "certificates": len(self.certificates)}


@dataclass(frozen=True, slots=True)
class PeerJoined(Event):
    """A peer is there; what it offers is told by `PeerShared`."""

    key: str
    host: str
    """Its name."""
    address: str
    admitted_by: str
    """`pairing`, `certificate` or `development`."""
    life: str
    """Names its run."""


@dataclass(frozen=True, slots=True)
class PeerShared(Event):
    """A peer offers something, or something else than before."""

    host: str
    """Its name."""
    peer: PeerRecord = field(repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Only names: what its components are stands in the catalogue."""
        offered = [component.id for component in self.peer.components]
        return {"host": self.host, "address": self.peer.address, "components": offered}


@dataclass(frozen=True, slots=True)
class PeerLeft(Event):
    """A peer is gone: nothing that it offered may be used from now on."""

    key: str
    host: str
    """Its name."""
    reason: str


@dataclass(frozen=True, slots=True)
class PeerTurnedAway(Event):
    """Somebody who may not be a peer tried to be one."""

    host: str
    """Its name, as far as it is known, or its address."""
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class UnitsTaken(Event):
    """What others have in use, as one host tells it: all of it, each time."""

    JOURNALLED: ClassVar[bool] = False
    host: str
    """Who tells."""
    taken: Mapping[str, str] = field(default_factory=dict)
    """Fact that does not hold, `idle` or `free` → the host that uses what it is about."""


# People and plans


@dataclass(frozen=True, slots=True)
class MountSet(Event):
    """A person said where a unit sits on its body (metres; roll, pitch, yaw in radians)."""

    unit: str
    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class InputConnected(Event):
    """A person said which stream an optional input is to get."""

    input: str
    """`component.unit.slot`"""
    stream: str
    """Empty: the host picks again."""


@dataclass(frozen=True, slots=True)
class GoalGiven(Event):
    """A person, or something that speaks for one, wants something."""

    goal: str
    """Id of the goal on this host."""
    text: str
    kind: str
    """`achieve` or `maintain`."""
    pddl: str
    """The condition, `self` replaced by the host's name."""
    priority: int = 0


@dataclass(frozen=True, slots=True)
class PlanMade(Event):
    """A goal has a plan."""

    goal: str
    revision: int
    steps: tuple[str, ...]
    reason: str = ""


@dataclass(frozen=True, slots=True)
class PlanMissing(Event):
    """A goal has no plan as things are; it waits, suspended."""

    goal: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class GoalReached(Event):
    """A goal holds."""

    goal: str


@dataclass(frozen=True, slots=True)
class GoalEnded(Event):
    """A goal is not pursued any more: achieved, halted or replaced."""

    goal: str
    reason: str
