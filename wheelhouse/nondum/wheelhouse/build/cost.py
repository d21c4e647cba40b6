"""What each kind of host that a payload is built for costs in bytes on the drive.

A wheel that several of them take lies there once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.target import Target
from nondum.wheelhouse.payload import host_facts
from nondum.wheelhouse.payload.payload import StagedPayload

LARGE_BYTES = 100_000_000
"""A payload from this size on is worth a word: a stick takes a minute to be written, or more."""


@frozen
class Cost:
    """What one kind of host takes."""

    target: Target
    all_bytes: int
    """All wheels that such a host takes."""
    own_bytes: int
    """Those that no other kind of host takes: what leaving it out would save."""


def costs(payload: StagedPayload, targets: Sequence[Target]) -> tuple[Cost, ...]:
    """What each target costs; the one that would save most first. Raises `PayloadRefused`."""
    taken = {target: _taken(payload, target) for target in targets}
    users = Counter(path for wheels in taken.values() for path in wheels)
    found = [
        Cost(
            target,
            sum(wheels.values()),
            sum(size for path, size in wheels.items() if users[path] == 1),
        )
        for target, wheels in taken.items()
    ]
    return tuple(sorted(found, key=lambda cost: (-cost.own_bytes, -cost.all_bytes, cost.target)))


def _taken(payload: StagedPayload, target: Target) -> dict[str, int]:
    """Path → size of the wheels that such a host takes, each once."""
    chosen = payload.wheels(host_facts.of_target(target)).values()
    return {wheel.path: wheel.size for wheels in chosen for wheel in wheels}
