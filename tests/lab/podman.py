"""podman for a machine that has no network: Debian's packages of it, and what they need there."""

from __future__ import annotations

import shutil
from pathlib import Path

from tests.lab.building import Built
from tests.lab.cache import call, kept

PACKAGES = ("podman", "runc")


def podman_debs(machine: Built) -> Path:
    """A folder of all .deb files that the machine lacks for it, from the cache or fetched now."""
    kind = f"podman-{machine.recipe.name}"
    return kept(f"{kind}-{machine.recipe.key}", lambda folder: _fetch(machine, folder)) / "debs"


def _fetch(machine: Built, folder: Path) -> None:
    """Asks apt what is missing of them, as the machine's own would."""
    lists, cache = folder / "lists", folder / "cache"
    for made in (lists / "partial", cache / "archives/partial"):
        made.mkdir(parents=True)
    options = {
        "Dir::State::status": machine.root / "var/lib/dpkg/status",
        "Dir::State::lists": lists,
        "Dir::Cache": cache,
        "APT::Architecture": machine.recipe.debian,
        "APT::Architectures": machine.recipe.debian,
        "APT::Sandbox::User": "root",
        "Debug::NoLocking": "true",
    }
    apt = ("apt-get", "-qq", *(f"-o{name}={value}" for name, value in options.items()))
    call(*apt, "update")
    words = ("--download-only", "--no-install-recommends", "-y")
    call(*apt, "install", *words, *PACKAGES)
    (folder / "debs").mkdir()
    for deb in (cache / "archives").glob("*.deb"):
        shutil.move(deb, folder / "debs")
    shutil.rmtree(lists)
    shutil.rmtree(cache)
