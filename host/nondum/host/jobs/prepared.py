"""A component whose venv is made: what its worker is started from, and its record made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from nondum.host.core.records.component import ComponentRecord, ComponentState
from nondum.host.core.records.data import DataClaim
from nondum.host.core.records.device import DeviceClaim
from nondum.host.core.records.mount import MountPose
from nondum.host.jobs.installed_component import InstalledComponent
from nondum.host.workers.spec import Limits, WorkerSpec, base_interpreter
from nondum.planning.merge.contribution import object_name
from nondum.sdk.codec.values import from_plain
from nondum.sdk.frozen import frozen


@frozen
class Prepared(InstalledComponent):
    """One component, installed and not yet active; its id is its name on this host."""

    scratch: Path
    shown: Path
    """Where the data are that it is shown."""

    @classmethod
    def parse(cls, said: Mapping[str, Any], name: str, scratch: Path, shown: Path) -> Prepared:
        """Read an `InstalledComponent`. It comes from our own child and is trusted."""
        told = {**said, "id": name, "scratch": str(scratch), "shown": str(shown)}
        return from_plain(cls, told, said["id"])

    def spec(self, payload: str, limits: Limits, settings: Mapping[str, Any]) -> WorkerSpec:
        """What its worker is started from; `limits` hold where it asks for no others, `settings`
        over those of its payload."""
        changed = self.limits.given()
        changed.pop("startup_s", None)  # no limit of a process, but of how long it is waited for
        return WorkerSpec(
            component=self.id,
            payload=payload,
            distribution=self.distribution,
            entry_point=self.entry_point,
            site_packages=(self.site_packages,),
            python=base_interpreter(),
            scratch=self.scratch,
            index=self.description,
            settings={**self.settings, **settings},
            permissions=self.permissions,
            limits=replace(limits, **changed),
            asked=self.limits,
            shown=self.shown if self.data else None,
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
            devices=tuple(DeviceClaim(n.name, n.match, n.optional) for n in self.devices),
            data=tuple(DataClaim(need) for need in self.data),
        )

    def poses(self, host: str) -> tuple[MountPose, ...]:
        """Where its units sit, as the payload says."""
        return tuple(
            MountPose(object_name(host, self.id, unit.name), unit.xyz, unit.rpy, "payload")
            for unit in self.units
        )
