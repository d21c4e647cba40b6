"""A component whose venv is made: what its worker is started from, and its record made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nondum.host.core.records import ComponentRecord, ComponentState, DeviceClaim, MountPose
from nondum.host.workers.spec import Limits, WorkerSpec, base_interpreter
from nondum.planning.merge.contribution import object_name
from nondum.sdk.description import PluginDescription


@dataclass(frozen=True, slots=True)
class Prepared:
    """One component, installed and not yet active."""

    id: str
    """Its name on this host."""
    distribution: str
    entry_point: str
    description: PluginDescription
    venv: Path
    site_packages: Path
    scratch: Path
    permissions: tuple[str, ...]
    settings: Mapping[str, Any]
    claims: tuple[DeviceClaim, ...]
    mounts: tuple[tuple[str, tuple[float, ...], tuple[float, ...]], ...]
    """(unit, xyz, rpy) as the manifest has them."""

    @classmethod
    def parse(cls, said: Mapping[str, Any], name: str, scratch: Path) -> Prepared:
        """Read what the job `install` told. It comes from our own child and is trusted."""
        return cls(
            id=name,
            distribution=said["distribution"],
            entry_point=said["entry_point"],
            description=PluginDescription.parse(said["description"], where=said["id"]),
            venv=Path(said["venv"]),
            site_packages=Path(said["site_packages"]),
            scratch=scratch,
            permissions=tuple(said["permissions"]),
            settings=said["settings"],
            claims=tuple(
                DeviceClaim(need["name"], need["match"], need["optional"])
                for need in said["devices"]
            ),
            mounts=tuple(
                (mount["unit"], tuple(mount["xyz"]), tuple(mount["rpy"]))
                for mount in said["mounts"]
            ),
        )

    def spec(self, payload: str, limits: Limits) -> WorkerSpec:
        """What its worker is started from."""
        return WorkerSpec(
            component=self.id,
            payload=payload,
            distribution=self.distribution,
            entry_point=self.entry_point,
            site_packages=(self.site_packages,),
            python=base_interpreter(),
            scratch=self.scratch,
            index=self.description,
            settings=self.settings,
            permissions=self.permissions,
            limits=limits,
        )

    def record(self, payload: str) -> ComponentRecord:
        """What the catalogue keeps of it; payload id and rank are given as it is entered."""
        return ComponentRecord(
            id=self.id,
            payload=payload,
            payload_id="",
            distribution=self.distribution,
            entry_point=self.entry_point,
            version=self.description.version,
            state=ComponentState.READY,
            description=self.description,
            venv=self.venv,
            site_packages=self.site_packages,
            scratch=self.scratch,
            rank=0,
            permissions=self.permissions,
            settings=self.settings,
            devices=self.claims,
        )

    def poses(self, host: str) -> tuple[MountPose, ...]:
        """Where its units sit, as the payload says."""
        return tuple(
            MountPose(object_name(host, self.id, unit), _xyz(xyz), _xyz(rpy), "payload")
            for unit, xyz, rpy in self.mounts
        )


def _xyz(numbers: tuple[float, ...]) -> tuple[float, float, float]:
    x, y, z = numbers
    return x, y, z
