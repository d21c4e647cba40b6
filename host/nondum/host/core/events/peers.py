"""Peers come, say what they offer, and go."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from nondum.host.core.events.event import Event
from nondum.host.core.records.peer import PeerRecord
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class CertificatesBrought(Event):
    """A drive carries certificates of hosts, this one's perhaps."""

    drive: str
    certificates: tuple[str, ...] = field(repr=False)
    """As they were read: nothing has checked them."""

    def to_dict(self) -> dict[str, Any]:
        """Only how many: anybody can write a drive."""
        return {"drive": self.drive, "certificates": len(self.certificates)}


@frozen
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


@frozen
class PeerShared(Event):
    """A peer offers something, or something else than before."""

    host: str
    """Its name."""
    peer: PeerRecord = field(repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Only names: what its components are stands in the catalogue."""
        offered = [component.id for component in self.peer.components]
        return {"host": self.host, "address": self.peer.address, "components": offered}


@frozen
class PeerLeft(Event):
    """A peer is gone: nothing that it offered may be used from now on."""

    key: str
    host: str
    """Its name."""
    reason: str


@frozen
class PeerTurnedAway(Event):
    """Somebody who may not be a peer tried to be one."""

    host: str
    """Its name, as far as it is known, or its address."""
    problems: tuple[Problem, ...]
