"""Components of active payloads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from enum import Enum
from pathlib import Path
from typing import Any

from nondum.host.core.records.data import DataClaim
from nondum.host.core.records.device import DeviceClaim
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


class ComponentState(Enum):
    """How a component of an active payload is."""

    READY = "ready"
    """Its worker runs and answers."""
    RESTARTING = "restarting"
    """Its worker ended; supervision starts it again."""
    QUARANTINED = "quarantined"
    """Its worker failed too often; it waits for a replug or a person."""


@frozen
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
    data: tuple[DataClaim, ...] = ()
    """What it is shown. Not kept: each daemon settles it again."""

    @property
    def abilities(self) -> tuple[str, ...]:
        """The names of its behaviours."""
        return tuple(behaviour.name for behaviour in self.description.behaviours)

    @property
    def is_ready(self) -> bool:
        """Whether its worker answers, and all devices and data are there that it needs."""
        return self.state is ComponentState.READY and not self.missing

    @property
    def missing(self) -> tuple[str, ...]:
        """The names of all its needs that nothing here meets, and that it does not act without."""
        return (*self.missing_devices, *self.missing_data)

    @property
    def missing_devices(self) -> tuple[str, ...]:
        """The names of its needs that no device serves, and that it does not act without."""
        claims = (claim for claim in self.devices if not claim.optional)
        return tuple(claim.name for claim in claims if claim.device is None)

    @property
    def missing_data(self) -> tuple[str, ...]:
        """The names of its needs of data that nothing here meets, and that it does not act
        without."""
        claims = (claim for claim in self.data if not claim.need.optional)
        return tuple(claim.need.name for claim in claims if claim.data is None)
