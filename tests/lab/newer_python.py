"""The Python of the next Debian on a disk for a machine, as files that its apt installs offline."""

from __future__ import annotations

import hashlib
from pathlib import Path

from tests.lab.building import Built, make_disk
from tests.lab.cache import call, kept

SUITE = "trixie"
PACKAGES = ("python3", "python3-venv")
DISK_MB = 256


def newer_python(machine: Built) -> Path:
    """The image of a disk with Debian 13's Python and all that it needs which a machine has not in
    that version; cached or made now."""
    key = hashlib.sha256(Path(__file__).read_bytes() + machine.recipe.key.encode()).hexdigest()[:16]
    kind = f"python-{machine.recipe.name}"
    return kept(f"{kind}-{key}", lambda folder: _make(machine, folder)) / "disk.img"


def _make(machine: Built, folder: Path) -> None:
    """By this machine's apt, told to look upon the other one's packages as installed."""
    sources = (machine.root / "etc/apt/sources.list").read_text(encoding="utf-8")
    for place in ("lists/partial", "archives/partial", "none"):
        (folder / place).mkdir(parents=True)
    (folder / "sources.list").write_text(
        sources.replace(machine.recipe.suite, SUITE), encoding="utf-8"
    )
    told = (
        *("-q", "-y", "-o", f"Dir::State={folder}", "-o", f"Dir::State::lists={folder}/lists"),
        *("-o", f"Dir::State::status={machine.root}/var/lib/dpkg/status"),
        *("-o", f"Dir::Etc::sourcelist={folder}/sources.list"),
        *("-o", f"Dir::Etc::sourceparts={folder}/none", "-o", f"Dir::Cache={folder}"),
        *("-o", f"APT::Architecture={machine.recipe.debian}"),
        *("-o", f"APT::Architectures::={machine.recipe.debian}", "-o", "APT::Sandbox::User=root"),
    )
    call("apt-get", *told, "update")
    call("apt-get", *told, "--no-install-recommends", "--download-only", "install", *PACKAGES)
    make_disk(folder / "archives", folder / "disk.img", DISK_MB, label="python")
