"""Peers, and what they offer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from nondum.host.core.records.mount import MountPose
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.signature import parse_signature


@frozen
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


@frozen
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
