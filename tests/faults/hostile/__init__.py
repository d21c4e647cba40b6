"""The corpus of hostile drives: a module a family, each drive with the code that it is told with.

    for number, drive in enumerate(DRIVES):
        drive.make(Bench(folder, number, canary))

All are made from words here; none is stored. Where code of theirs could run, it makes the file
`canary`, which must never be there.
"""

from __future__ import annotations

from tests.faults.hostile import (
    beside,
    changes,
    envelope,
    folders,
    images,
    indexes,
    locks,
    manifests,
    objects,
    paths,
    signing,
    wheels,
)
from tests.faults.hostile.case import Bench, HostileDrive

FAMILIES: dict[str, tuple[HostileDrive, ...]] = {
    "signatures": signing.DRIVES,
    "contents lists": envelope.DRIVES,
    "paths": paths.DRIVES,
    "files that are none": objects.DRIVES,
    "changed files": changes.DRIVES,
    "manifests": manifests.DRIVES,
    "locks": locks.DRIVES,
    "indexes": indexes.DRIVES,
    "folders": folders.DRIVES,
    "beside payloads": beside.DRIVES,
    "file systems": images.DRIVES,
    "wheels": wheels.DRIVES,
}
DRIVES = tuple(drive for family in FAMILIES.values() for drive in family)

__all__ = ["DRIVES", "FAMILIES", "Bench", "HostileDrive"]
