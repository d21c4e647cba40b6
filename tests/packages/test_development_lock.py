"""The lock of what `./run` and tox install: whole, no more than that, and held to."""

from __future__ import annotations

import configparser
import hashlib
import itertools
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from tests.kit.payloads import make_wheel

from nondum_dev import asked, lockfile
from nondum_dev.places import CHECKOUT, LOCK, PACKAGING

TEXT = LOCK.read_text(encoding="utf-8")
ENTRIES = lockfile.parse(TEXT)
ASKED = asked.of_all(CHECKOUT)
ENVIRONMENTS = list(itertools.product(("3.11", "3.12", "3.13"), ("x86_64", "aarch64")))


@pytest.mark.parametrize(("python", "machine"), ENVIRONMENTS)
def test_all_that_is_asked_for_is_locked(python: str, machine: str) -> None:
    pinned = _pinned(python, machine)
    for requirement in map(Requirement, ASKED):
        if _is_meant(requirement, python, machine):
            name = lockfile.canonical(requirement.name)
            assert name in pinned, f"{requirement}: run `./run lock`"
            assert pinned[name] in requirement.specifier, f"{requirement}: run `./run lock`"


def test_nothing_is_locked_that_is_not_needed() -> None:
    needed = lockfile.needed(ENTRIES, map(asked.name_of, ASKED))
    assert {entry.name for entry in ENTRIES} <= needed, "run `./run lock`"


def test_every_version_has_its_hashes_and_no_address() -> None:
    for entry in ENTRIES:
        first, *hashes = entry.text.replace(" \\\n", "\n").splitlines()
        Requirement(first)
        assert hashes
        assert all(re.fullmatch(r"    --hash=sha256:[0-9a-f]{64}", line) for line in hashes)
    assert "://" not in TEXT


def test_tox_installs_by_the_lock_only() -> None:
    tox = configparser.ConfigParser(interpolation=None)
    tox.read(CHECKOUT / "tox.ini")
    assert "packaging/development install" in tox["testenv"]["install_command"]
    assert tox["pkgenv"]["install_command"] == "{[testenv]install_command}"
    locked = {entry.name for entry in ENTRIES}
    for section in tox.values():
        for word in section.get("deps", "").split():
            assert word.startswith("./") or lockfile.canonical(word) in locked, word
        assert section.name in ("testenv", "pkgenv") or "install_command" not in section


def test_what_has_the_locked_hash_is_installed(checkout: Path) -> None:
    done = _install(checkout, "useful")
    assert done.returncode == 0, done.stderr
    assert _installed(checkout) == {"useful", "its_need"}


def test_what_has_another_hash_is_not_installed(checkout: Path) -> None:
    lock = checkout / LOCK.relative_to(CHECKOUT)
    digest = re.findall("sha256:(.{8})", lock.read_text())[-1]
    lock.write_text(lock.read_text().replace(digest, "00000000"))
    done = _install(checkout, "useful")
    assert done.returncode == 1
    assert not _installed(checkout)
    assert "run: pip has not installed what packaging/development/requirements.lock" in done.stderr


def test_what_is_not_locked_is_not_installed(checkout: Path) -> None:
    make_wheel(checkout / "index", "stranger", "1.0", {"stranger.py": ""})
    done = _install(checkout, "useful", "stranger>=1")
    assert done.returncode == 1
    assert not _installed(checkout)
    assert done.stderr == (
        "run: packaging/development/requirements.lock does not have stranger: `./run lock`\n"
    )


def test_need_that_a_package_of_the_index_has_grown_is_not_installed(checkout: Path) -> None:
    make_wheel(checkout / "index", "useful", "1.1", {"useful.py": ""}, requires=["stranger"])
    make_wheel(checkout / "index", "stranger", "1.0", {"stranger.py": ""})
    done = _install(checkout, "useful")
    assert done.returncode == 0, done.stderr
    assert _installed(checkout) == {"useful", "its_need"}


def test_names_of_the_checkout_are_not_asked_of_the_index(checkout: Path) -> None:
    make_wheel(checkout / "index", "nondum-sdk", "0.1.9", {"stranger.py": ""})
    assert _install(checkout, "useful", "nondum-sdk>=0.1,<0.2").returncode == 0
    assert _installed(checkout) == {"useful", "its_need"}


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout whose lock has two packages, and the folder that they come from."""
    shutil.copytree(PACKAGING / "development", tmp_path / "packaging/development")
    for name in ("pyproject.toml", "plugins/sdk/pyproject.toml"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(CHECKOUT / name, tmp_path / name)
    index = tmp_path / "index"
    index.mkdir()
    useful = make_wheel(index, "useful", "1.0", {"useful.py": ""}, requires=["its-need"])
    need = make_wheel(index, "its-need", "1.0", {"its_need.py": ""})
    (tmp_path / LOCK.relative_to(CHECKOUT)).write_text(
        f"its-need==1.0 \\\n    --hash=sha256:{_digest(need)}\n    # via useful\n"
        f"useful==1.0 \\\n    --hash=sha256:{_digest(useful)}\n"
    )
    return tmp_path


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _install(checkout: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run the checkout's installer; what it installs lies in a folder of the checkout."""
    ours = {
        "PIP_TARGET": str(checkout / "installed"),
        "PIP_FIND_LINKS": str(checkout / "index"),
        "PIP_NO_INDEX": "1",
    }
    program = str(checkout / "packaging/development")
    command = [sys.executable, "-P", program, "install", *words]
    return subprocess.run(command, env={**os.environ, **ours}, capture_output=True, text=True)


def _installed(checkout: Path) -> set[str]:
    return {file.stem for file in (checkout / "installed").glob("*.py")}


def _pinned(python: str, machine: str) -> dict[str, str]:
    """The version of each name in an environment; one of each."""
    lines = [entry.text.partition("\\")[0] for entry in ENTRIES]
    meant = [r for r in map(Requirement, lines) if _is_meant(r, python, machine)]
    versions = {r.name: str(r.specifier).removeprefix("==") for r in meant}
    assert len(versions) == len(meant)
    return versions


def _is_meant(requirement: Requirement, python: str, machine: str) -> bool:
    there = {
        "python_version": python,
        "python_full_version": f"{python}.0",
        "platform_machine": machine,
    }
    marker = requirement.marker
    return marker is None or marker.evaluate(there)
