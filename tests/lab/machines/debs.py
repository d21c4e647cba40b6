"""nondum's Debian packages on a disk for a machine: this checkout's, and a newer build of it."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from tests.lab.machines.building import Built, make_disk
from tests.lab.machines.cache import call, kept
from tests.lab.machines.software import CHECKOUT, sources_key

OLD, NEW = "old.deb", "new.deb"
NEW_VERSION = "0.1.0+next"
BUILDS: dict[str, tuple[str, ...]] = {OLD: (), NEW: ("--version", NEW_VERSION)}
DISK_MB = 96


def debs(machine: Built) -> Path:
    """The image of a disk with both packages for a machine, cached or made now."""
    kind = f"debs-{machine.recipe.name}"
    return kept(f"{kind}-{sources_key()}", lambda folder: _make(machine, folder)) / "disk.img"


def _make(machine: Built, folder: Path) -> None:
    tree = folder / "debs"
    tree.mkdir()
    for name, more in BUILDS.items():
        output = folder / name.partition(".")[0]
        builder = (sys.executable, "-m", "nondum_deb", "--arch", machine.recipe.debian)
        call(
            *builder,
            "--output",
            output,
            *more,
            env={"PYTHONPATH": str(CHECKOUT / "packaging/debian")},
        )
        (deb,) = output.iterdir()
        shutil.move(deb, tree / name)
    make_disk(tree, folder / "disk.img", DISK_MB, label="debs")
