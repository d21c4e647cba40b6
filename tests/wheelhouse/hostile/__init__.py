"""The corpus of hostile wheels: a module a family, each wheel with the code that refuses it.

    for case in WHEELS:
        (folder / case.filename).write_bytes(case.build(canary))

All are made from words here; none is stored. Where code of theirs could run, it makes the file
`canary`, which must never be there.
"""

from __future__ import annotations

from tests.wheelhouse.hostile import (
    hooks,
    limits,
    machines,
    members,
    metadata,
    overlays,
    places,
    records,
    structure,
)
from tests.wheelhouse.hostile.case import HostileWheel

FAMILIES: dict[str, tuple[HostileWheel, ...]] = {
    "structure": structure.WHEELS,
    "headers": members.WHEELS,
    "overlays": overlays.WHEELS,
    "limits": limits.WHEELS,
    "paths": places.WHEELS,
    "record": records.WHEELS,
    "metadata": metadata.WHEELS,
    "hooks": hooks.WHEELS,
    "machines": machines.WHEELS,
}
WHEELS = tuple(wheel for family in FAMILIES.values() for wheel in family)

__all__ = ["FAMILIES", "WHEELS", "HostileWheel"]
