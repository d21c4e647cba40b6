"""What has become of one payload that is to run on another host."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field

from nondum.host.peers.placement.decide import Candidate, Parcel
from nondum.host.peers.placement.handover import Handover
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

AGAIN_S = 30.0
"""After so long, a peer that did not take a payload is asked again: memory and disk get free."""
STEPS = ("waiting", "checking", "fetching", "installing", "active")


@frozen
class Declined:
    """Why a peer did not take a payload."""

    epoch: int
    """Of the peer: another life may think otherwise."""
    problems: tuple[Problem, ...]
    at_s: float
    is_final: bool
    """Whether it has tried: it would not work the next time either."""

    def holds(self, epoch: int, now_s: float) -> bool:
        """Whether there is no point in asking again yet."""
        return self.epoch == epoch and (self.is_final or now_s - self.at_s < AGAIN_S)


@dataclass(slots=True, eq=False)
class Case:
    """What has become of one parcel."""

    parcel: Parcel
    candidate: Candidate | None = None
    """The peer that is asked, or has it."""
    handover: Handover | None = None
    """What that peer may fetch."""
    step: str = ""
    """One of `STEPS`, as the peer tells; empty: no peer has it."""
    done: int = 0
    total: int = 0
    declined: dict[str, Declined] = field(default_factory=dict)
    """By host."""
    told: tuple[Problem, ...] = ()
    """The problems that people were told last, why no peer takes it."""
    task: asyncio.Task[None] | None = None

    @property
    def host(self) -> str:
        """The peer that is asked, or has it."""
        return self.candidate.host if self.candidate else ""
