"""What the component manager wants done: frozen values in the imperative, for the executor.

Each is idempotent: after a crash it may be carried out again from the start.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path

from nondum.host.core.records.data import DataRecord
from nondum.host.core.records.device import DeviceNode
from nondum.sdk.frozen import frozen


@frozen
class Effect:
    """Anything to be done."""


@frozen
class ReadDrive(Effect):
    """Mount the drive where it needs that, and look for payloads on it."""

    drive: str
    kind: str
    root: Path
    node: Path | None = None
    filesystem: str = ""
    keys: Mapping[str, str] = field(default_factory=dict)
    """Digest of a contents list → key of the payload that is here already."""


@frozen
class ReleaseDrive(Effect):
    """Let go of a drive: end its reader, unmount it."""

    drive: str


@frozen
class JudgePayloads(Effect):
    """Check again whether payloads that are here are trusted."""

    payloads: tuple[str, ...]


@frozen
class PayloadEffect(Effect):
    """Something to be done for one payload; one at a time for each."""

    payload: str


@frozen
class CopyPayload(PayloadEffect):
    """Copy what this host needs into staging, hashing on the way."""

    drive: str
    folder: Path
    digest: str
    beside: str = ""
    """Key of its active release, whose memory would become free for it."""


@frozen
class VerifyPayload(PayloadEffect):
    """Check the staged copy: manifest, locks, index, wheels, preflight."""


@frozen
class StagePayload(PayloadEffect):
    """Move the checked copy to its lasting place."""


@frozen
class StoreWheels(PayloadEffect):
    """Unpack each wheel that the store lacks into it, and reserve the memory that it needs."""

    beside: str = ""
    """Key of its active release, whose memory would become free for it."""
    renamed: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Id in the manifest → name on this host, of those components where that is another."""


@frozen
class ProbeComponents(PayloadEffect):
    """Make the venvs, start the workers, compare what they say with the index."""

    beside: str = ""
    """Key of its active release, which runs on meanwhile."""
    after: str = ""
    """Key of a payload whose workers must have ended first."""
    renamed: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Id in the manifest → name on this host, of those components where that is another."""


@frozen
class ActivatePayload(PayloadEffect):
    """Make the components' records for the catalogue."""

    beside: str = ""
    """Key of the release that it is to take over from, once it was seen to be healthy."""


@frozen
class CompileWheels(PayloadEffect):
    """Byte-compile what an active payload runs, for the next start; it may fail or never end."""


@frozen
class RestPayload(PayloadEffect):
    """Stop what runs of a superseded payload; it may be wanted again at once."""

    components: tuple[str, ...] = ()


@frozen
class NoteInstalled(PayloadEffect):
    """Write down beside a payload's files that it was installed for good, or undo that."""

    drive: str
    folder: Path | None
    """Where it came from; None: it is not installed for good any more."""


@frozen
class SuspendPayload(PayloadEffect):
    """Stop what runs of a quarantined payload and drop its venvs; it may be tried again."""

    components: tuple[str, ...] = ()


@frozen
class ClearPayload(PayloadEffect):
    """Stop what runs of a payload and delete all of it but the wheels in the store."""

    components: tuple[str, ...] = ()


@frozen
class CachePayload(ClearPayload):
    """The same for one that was withdrawn: it may come back, so what was made of it is cached."""


@frozen
class RestartWorker(Effect):
    """Start a quarantined component's worker once more."""

    component: str


@frozen
class AttachDevice(Effect):
    """Give nodes of a device to a component: these, instead of any that it has for that need."""

    component: str
    need: str
    nodes: tuple[DeviceNode, ...]


@frozen
class ShowData(Effect):
    """Show data to a component, instead of any that it is shown for that need."""

    component: str
    payload: str
    """Key of the component's payload."""
    need: str
    data: DataRecord


@frozen
class HideData(Effect):
    """Show a component no data for a need."""

    component: str
    payload: str
    """Key of the component's payload."""
    need: str


@frozen
class DetachDevice(Effect):
    """Take a device from a component."""

    component: str
    need: str
    device: str
