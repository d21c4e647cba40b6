"""What a run of the benchmark found, as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from benchmarks.recompose.insertion import Insertion, Memory

FIRST = "nondum, first time"
KNOWN = "nondum, known before"
LOAD = "podman load + run"
START = "podman run, image loaded"
WAYS = (FIRST, LOAD, KNOWN, START)


@dataclass(frozen=True, slots=True)
class Container:
    """Proportional set sizes of a container at rest, in MB."""

    process: float
    conmon: float
    """podman's process that stays beside every container."""


@dataclass(slots=True)
class Findings:
    """All about one payload; lists have one entry a round."""

    name: str
    content: str
    """Its libraries, in words."""
    bytes: dict[str, int] = field(default_factory=dict)
    """What is carried → bytes on the drive."""
    insertions: dict[str, list[Insertion]] = field(default_factory=dict)
    """Way → insertions into a host."""
    starts_s: dict[str, list[float]] = field(default_factory=dict)
    """Way → seconds until a container was ready."""
    memory: list[Memory] = field(default_factory=list)
    containers: list[Container] = field(default_factory=list)
    calm: list[bool] = field(default_factory=list)
    """Of each measurement, whether the machine had nothing else to do when it began."""

    def ready_s(self, way: str) -> list[float]:
        """Seconds until ready, by round; empty when it was not measured."""
        if way in self.insertions:
            return [insertion.ready_s for insertion in self.insertions[way]]
        return self.starts_s.get(way, [])


@dataclass(frozen=True, slots=True)
class Results:
    """One run."""

    machine: tuple[str, ...]
    payloads: tuple[Findings, ...]
    missing: str = ""
    """Why no container was measured; empty when they were."""


AIMS: Mapping[str, Mapping[str, float]] = {
    "small": {FIRST: 0.2, KNOWN: 0.1},
    "big": {FIRST: 0.6, KNOWN: 0.1},
}
"""Payload → way → the greatest ratio to `LOAD` that nondum promises."""
