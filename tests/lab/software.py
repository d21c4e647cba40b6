"""nondum itself, as a person installs it offline: wheels of this checkout in a venv at /opt/nondum.

The venv is made by the machine's own Python, in its root file system before it is booted, and put
on a separate disk: a change of nondum does not cost a new root file system.
"""

from __future__ import annotations

import hashlib
import re
import shutil
import sys
import zipfile
from collections.abc import Iterator
from email import message_from_bytes
from pathlib import Path

from packaging.requirements import Requirement
from tests.lab.building import Built, make_disk
from tests.lab.cache import call, kept
from tests.lab.recipe import HERE

CHECKOUT = Path(__file__).parents[2]
PLAIN = HERE / "plain"
PLUGINS = (
    *("plugins/host-lamps", "plugins/pddl-workbench"),
    *("plugins/planner-fast-downward", "plugins/planner-pyperplan"),
)
DISTRIBUTIONS = ("plugins/sdk", *PLUGINS, ".")
SOURCES = (
    *("pyproject.toml", "host", "planning", "transport", "wheelhouse", "plugins/sdk"),
    *PLUGINS,
    *("packaging", "README.md", "LICENSE"),
)
EXTRAS = {"nondum": "fast", "nondum_planner_fast_downward": "engine"}
"""What is installed with our own distributions."""
SDK_NEEDS = ("pluggy", "msgpack")
FOR_PAYLOADS = "for-payloads"
"""The folder beside the image with wheels of what the SDK needs, for that machine's processor."""
LOCK = CHECKOUT / "packaging/development/requirements.lock"
"""Versions and hashes of all that others wrote."""
PREFIX = "/opt/nondum"
DISK_MB = 768
PLATFORMS = (
    "manylinux_2_36",
    "manylinux_2_34",
    "manylinux_2_28",
    "manylinux_2_17",
    "manylinux2014",
)
"""What its C library takes: Debian 12's, or a newer one."""

INSTALL = """
set -eu
mount --bind "$1" "$2/opt/nondum"
mount --bind "$3" "$2/mnt"
mount -t tmpfs tmpfs "$2/tmp"
root=$2
shift 3
exec chroot "$root" /bin/sh -eu -c '
    python3 -m venv --without-pip /opt/nondum
    /opt/nondum/bin/python "$(echo /usr/share/python-wheels/pip-*.whl)/pip" install \
        -q --no-index --find-links /mnt --no-cache-dir --no-compile "$@"
' sh "$@"
"""
COMPILE = """
set -eu
mount --bind "$1" "$2/opt/nondum"
chroot "$2" /opt/nondum/bin/python -m compileall -q /opt/nondum/lib || true
"""
COMPILE_HERE = '"$3" -m compileall -q -s "$1" -p "$2" "$1/lib" || true'
"""What does not compile is some package's test of that."""


def software(machine: Built, commit: str | None = None) -> Path:
    """The image of /opt/nondum with what this checkout has now, or had at a commit; from the cache
    or made now (ten seconds)."""
    kind = f"nondum-{machine.recipe.name}"
    key = f"{_commit_key(commit) if commit else sources_key()}{machine.folder.name[-6:]}"
    return kept(f"{kind}-{key}", lambda folder: _make(machine, commit, folder)) / "disk.img"


def _make(machine: Built, commit: str | None, folder: Path) -> None:
    wheels, venv = folder / "wheels", folder / "venv"
    source = _archived(commit, folder / "source") if commit else CHECKOUT
    _own_wheels(source, wheels)
    wanted = sorted(map(_requirement, wheels.iterdir()))
    for wheel in _dependencies(machine, wheels).glob("*.whl"):
        shutil.copy(wheel, wheels)
    venv.mkdir()
    call("unshare", "--mount", "sh", "-c", INSTALL, "sh", venv, machine.root, wheels, *wanted)
    shutil.copytree(_packaging(source), venv / "packaging")
    _compile(machine, venv)
    make_disk(venv, folder / "disk.img", DISK_MB, label="nondum")
    (folder / FOR_PAYLOADS).mkdir()
    for name in SDK_NEEDS:
        (wheel,) = wheels.glob(f"{name}-*.whl")
        shutil.copy(wheel, folder / FOR_PAYLOADS)
    for done_with in (venv, wheels, folder / "source"):
        shutil.rmtree(done_with, ignore_errors=True)


def _compile(machine: Built, venv: Path) -> None:
    """Compile what was installed, on a disk that is read-only from now on. Where it is emulated,
    the machine's own Python takes ten times as long as one of the same version here."""
    if f"{sys.version_info.major}.{sys.version_info.minor}" == machine.recipe.python:
        call("sh", "-c", COMPILE_HERE, "sh", venv, PREFIX, sys.executable)
    else:
        call("unshare", "--mount", "sh", "-c", COMPILE, "sh", venv, machine.root)


def _archived(commit: str, folder: Path) -> Path:
    folder.mkdir()
    archive = folder / "source.tar"
    call("git", "-C", CHECKOUT, "archive", "-o", archive, commit, "--", *_sources(commit))
    call("tar", "-C", folder, "-xf", archive)
    return folder


def _sources(commit: str) -> list[str]:
    """Of SOURCES, those that a commit has: an older one lacks some."""
    return call("git", "-C", CHECKOUT, "ls-tree", "--name-only", commit, *SOURCES).split()


def _commit_key(commit: str) -> str:
    """A hash of a commit, and of how this module installs it."""
    name = call("git", "-C", CHECKOUT, "rev-parse", "--verify", f"{commit}^{{commit}}")
    return hashlib.sha256(name.encode() + Path(__file__).read_bytes()).hexdigest()[:16]


def _packaging(source: Path) -> Path:
    """The units that go with nondum; simple ones of the laboratory's while there are none."""
    units = source / "packaging"
    return units if (units / "systemd/nondum.service").exists() else PLAIN


def _own_wheels(source: Path, folder: Path) -> None:
    places = [source / path for path in DISTRIBUTIONS if (source / path).is_dir()]
    held = ("--no-deps", "--no-index", "--no-build-isolation")
    call(sys.executable, "-m", "pip", "wheel", "-q", *held, "-w", folder, *places)


def _requirement(wheel: Path) -> str:
    """One of our own wheels, with its extras, as a requirement for pip."""
    name = wheel.name.partition("-")[0]
    return f"{name}[{EXTRAS[name]}]" if name in EXTRAS else name


def _dependencies(machine: Built, own: Path) -> Path:
    """Wheels of everything that nondum needs, fetched again when that, or the lock, has changed."""
    needs = sorted({need for wheel in own.iterdir() for need in _needs(machine, wheel)})
    key = hashlib.sha256(f"{PLATFORMS}{needs}{LOCK.read_text()}".encode()).hexdigest()[:16]
    name = f"wheels-{machine.recipe.name}-{key}"
    return kept(name, lambda folder: _fetch(machine, needs, folder))


def _fetch(machine: Built, needs: list[str], folder: Path) -> None:
    lock = folder / LOCK.name
    lock.write_text(re.sub(r" ;[^\\\n]*", "", LOCK.read_text()))  # without markers: see _needs
    call(
        *(sys.executable, "-m", "pip", "download", "-q", "--only-binary", ":all:"),
        *("--require-hashes", "-c", lock, "--python-version", machine.recipe.python, "-d", folder),
        *(f"--platform={name}_{machine.recipe.architecture}" for name in PLATFORMS),
        *needs,
    )


def _needs(machine: Built, wheel: Path) -> Iterator[str]:
    """What one of our own wheels needs of others' on that machine. (pip would ask the markers of
    what is needed there of the machine that it runs on.)"""
    there = {
        "platform_machine": machine.recipe.architecture,
        "python_version": machine.recipe.python,
    }
    extras = EXTRAS.get(wheel.name.partition("-")[0], "")
    with zipfile.ZipFile(wheel) as archive:
        (metadata,) = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        said = message_from_bytes(archive.read(metadata)).get_all("Requires-Dist", [])
    for requirement in map(Requirement, said):
        marker = requirement.marker
        is_needed = marker is None or marker.evaluate({**there, "extra": extras})
        if is_needed and not requirement.name.startswith("nondum"):
            yield f"{requirement.name}{requirement.specifier}"


def sources_key() -> str:
    """A hash of all that nondum is made from."""
    total = hashlib.sha256()
    names = call("git", "-C", CHECKOUT, "ls-files", "-co", "--exclude-standard", "--", *SOURCES)
    for name in sorted(set(names.split("\n"))):
        path = CHECKOUT / name
        if path.is_file():
            total.update(name.encode() + b"\0" + path.read_bytes())
    total.update(Path(__file__).read_bytes())
    return total.hexdigest()[:16]
