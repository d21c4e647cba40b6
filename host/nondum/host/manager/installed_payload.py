"""A payload whose venvs are made, as the daemon keeps it while the payload is there."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nondum.host.config.component_settings import ComponentSettings
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.data import DataRecord
from nondum.host.core.records.mount import MountPose
from nondum.host.jobs.prepared import Prepared
from nondum.host.manager.headroom import Needs
from nondum.host.manager.state_folders import Folders
from nondum.host.workers.spec import Limits, WorkerSpec
from nondum.sdk.codec.values import from_plain
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.data import FOLDER
from nondum.wheelhouse.format.signatures import Grant
from nondum.wheelhouse.payload.gpu import Gpu


@frozen
class InstalledPayload:
    """What its workers are started from, what it needs, and what it may have."""

    key: str
    components: tuple[Prepared, ...]
    needs: Needs
    grant: Grant
    goals: tuple[str, ...]
    """The goals that it brings, as written."""
    gpu: Gpu | None
    """The graphics processor that the host was found to have, if any."""
    fresh: int
    """Wheels that the store did not have."""
    is_compiled: bool
    """Whether its workers would start no sooner if its modules were compiled once more."""
    told: Mapping[str, Any]
    """What the job told, from which this is."""
    data: tuple[DataRecord, ...] = ()

    @classmethod
    def parse(
        cls,
        key: str,
        told: Mapping[str, Any],
        renamed: Mapping[str, str],
        folders: Folders,
    ) -> InstalledPayload:
        """Read what the job `install` told. It comes from our own child and is trusted.

        `renamed` has the names on this host of components that have another one in the payload.
        """
        named = [(said, renamed.get(said["id"], said["id"])) for said in told["components"]]
        data = folders.payload(key) / FOLDER
        return cls(
            key,
            tuple(
                Prepared.parse(said, name, folders.scratch(key, name), folders.shown(key, name))
                for said, name in named
            ),
            Needs.parse(told["needs"]),
            Grant.parse(told["grant"]),
            tuple(told["goals"]),
            from_plain(Gpu, told["gpu"]) if told["gpu"] else None,
            told["fresh"],
            not told["uncompiled"],
            told,
            tuple(_brought(said, key, data / said["name"]) for said in told["data"]),
        )

    @property
    def ids(self) -> tuple[str, ...]:
        """Its components, by their names on this host."""
        return tuple(component.id for component in self.components)

    def specs(self, limits: Limits, settings: ComponentSettings) -> tuple[WorkerSpec, ...]:
        """What its workers are started from, with this host's settings over its own."""
        own_ids = (said["id"] for said in self.told["components"])
        return tuple(
            component.spec(self.key, limits, settings.get((self.needs.payload_id, own_id), {}))
            for component, own_id in zip(self.components, own_ids, strict=True)
        )

    def records(self) -> tuple[ComponentRecord, ...]:
        """What the catalogue keeps of its components."""
        return tuple(component.record(self.key) for component in self.components)

    def poses(self, host: str) -> tuple[MountPose, ...]:
        """Where its units sit, as its manifest says."""
        return tuple(pose for component in self.components for pose in component.poses(host))


def _brought(said: Mapping[str, Any], key: str, folder: Path) -> DataRecord:
    """Data that it brings; the payload's id is given as they are entered."""
    return DataRecord(
        payload=key,
        payload_id="",
        name=said["name"],
        kind=said["kind"],
        version=said["version"],
        folder=folder,
        files=tuple(said["files"]),
        size=said["size"],
    )
