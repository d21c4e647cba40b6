"""What discovery has done and met, for `nondum peers --why`."""

from __future__ import annotations

from collections.abc import Mapping

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class InterfaceRow:
    """One interface. Times are on the loop's clock."""

    interface: str
    addresses: tuple[str, ...]
    """Its own."""
    is_looked_on: bool
    """Whether other hosts are looked for there."""
    announced_s: float | None = None
    """When this host was last announced there."""
    heard: int = 0
    """Peers that were heard there and are still hinted at."""
    heard_s: float | None = None
    """When the last of them was heard."""
    problem: Problem | None = None


@frozen
class StaticRow:
    """One host that the integrator has given. Times are on the loop's clock."""

    host: str
    asked: int
    """How often, since it last answered."""
    answered_s: float | None = None
    name: str = ""
    """What it calls itself."""
    problem: Problem | None = None


@frozen
class DiscoveryStatus:
    """All of it, at one moment."""

    interfaces: tuple[InterfaceRow, ...]
    static: tuple[StaticRow, ...]
    hints: int
    refused: Mapping[str, int]
    """How many hints were of no use, by code."""
    problems: tuple[Problem, ...]
    """What concerns no single interface or host: above all, another host with this one's key."""
