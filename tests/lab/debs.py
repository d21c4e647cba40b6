"""nondum's Debian packages on a disk for a machine: this checkout's, and a newer build of it."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.lab.building import Built, make_disk
from tests.lab.cache import call, kept
from tests.lab.software import CHECKOUT, sources_key

OLD, NEW = "old.deb", "new.deb"
VERSIONS = {OLD: "0.1.0+lab1", NEW: "0.1.0+lab2"}
DISK_MB = 96


def debs(machine: Built) -> Path:
    """The image of a disk with both packages for a machine, cached or made now."""
    kind = f"debs-{machine.recipe.name}"
    return kept(f"{kind}-{sources_key()}", lambda folder: _make(machine, folder)) / "disk.img"


def _make(machine: Built, folder: Path) -> None:
    tree = folder / "debs"
    versions = [f"--version={version}" for version in VERSIONS.values()]
    builder = (sys.executable, "-m", "nondum_deb", "--arch", machine.recipe.debian)
    place = {"PYTHONPATH": str(CHECKOUT / "packaging/debian")}
    call(*builder, "--output", tree, *versions, env=place)
    for name, version in VERSIONS.items():
        (tree / f"nondum_{version}_{machine.recipe.debian}.deb").rename(tree / name)
    make_disk(tree, folder / "disk.img", DISK_MB, label="debs")
