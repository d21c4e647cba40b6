"""A payload is found, installed step by step, refused, withdrawn or tried again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, ClassVar

from nondum.host.core.events.event import Event
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.data import DataRecord
from nondum.host.core.records.mount import MountPose
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.signatures import NOTHING, Grant


@frozen
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


@frozen
class PayloadCopied(Event):
    """What this host needs of the payload lies in staging, each file as its hash says."""

    payload: str
    bytes_copied: int = 0
    bytes_known: int = 0
    """Bytes of wheels that the store had already, so that they were not copied."""


@frozen
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


@frozen
class PayloadStaged(Event):
    """The checked copy is in its lasting place; the drive is not needed any more."""

    payload: str


@frozen
class WheelsStored(Event):
    """Every wheel of the payload is in the store, unpacked and safe on disk."""

    payload: str
    fresh: int
    """How many were not in the store before."""


@frozen
class ComponentsProbed(Event):
    """Every component's venv was made and its worker said what `index.json` says."""

    payload: str


@frozen
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
    data: tuple[DataRecord, ...] = ()
    """What it brings for components to read."""

    def to_dict(self) -> dict[str, Any]:
        """Only names: what the components are stands in the catalogue."""
        told = {"payload": self.payload, "components": [c.id for c in self.components]}
        more = {"goals": list(self.goals), "data": [brought.name for brought in self.data]}
        return told | {key: value for key, value in more.items() if value}


@frozen
class PayloadRefused(Event):
    """The payload is not what it claims, or does not fit this host."""

    payload: str
    problems: tuple[Problem, ...]


@frozen
class PayloadFailed(Event):
    """The payload's components could not be brought to life."""

    payload: str
    problems: tuple[Problem, ...]


@frozen
class PayloadWithdrawn(Event):
    """The payload's last source is gone: nothing of it may be used from now on."""

    payload: str
    reason: str
    rebuilt_as: str = ""
    """Key of the payload that was built in its place."""


@frozen
class PayloadCleared(Event):
    """Nothing of the payload runs, and its venvs, staging and folder are gone."""

    payload: str


@frozen
class RetryAsked(Event):
    """A refused or quarantined payload is to be tried again: a person asked for it, or the host
    does by itself."""

    payload: str
    why: str = ""
    """Why the host does; empty: a person asked."""


@frozen
class ForgetAsked(Event):
    """A person asked that a payload that is gone be forgotten."""

    payload: str
    """Its id: there is no key of what is gone."""


@frozen
class Recovered(Event):
    """A payload was found half done when the daemon started, and sent forward or back."""

    payload: str
    found: str
    """The step that it was found at."""


@frozen
class ProgressMade(Event):
    """A step of an installation is `done` of `total` through."""

    JOURNALLED: ClassVar[bool] = False
    payload: str
    phase: str
    done: int
    total: int


@frozen
class PayloadCached(Event):
    """The venvs of a payload that was withdrawn are made again, in case it comes back."""

    JOURNALLED: ClassVar[bool] = False
    payload: str


@frozen
class WheelsCompiled(Event):
    """Workers of a payload find its modules compiled when they are started again."""

    JOURNALLED: ClassVar[bool] = False
    payload: str
