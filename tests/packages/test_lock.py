"""The locks of the Debian packages: whole, and what the distributions of today ask for."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
LOCK = ROOT / "packaging/debian/requirements.lock"
BACKEND_LOCK = ROOT / "packaging/debian/backend.lock"
DISTRIBUTIONS = (
    *("plugins/sdk", ".", "plugins/host-lamps", "plugins/host-zenoh", "plugins/lab"),
    *("plugins/pddl-workbench", "plugins/planner-pyperplan"),
)
OWN = {
    *("nondum", "nondum-sdk", "nondum-host-lamps", "nondum-host-zenoh", "nondum-lab"),
    *("nondum-pddl-workbench", "nondum-planner-pyperplan"),
}


def test_lock_satisfies_what_is_declared() -> None:
    pinned = _pinned()
    for requirement in _declared():
        name = canonicalize_name(requirement.name)
        assert name in pinned, f"{requirement}: run `./run package --lock`"
        assert pinned[name] in requirement.specifier, requirement


def test_locked_backend_satisfies_what_is_declared() -> None:
    pinned = _pinned(BACKEND_LOCK)
    for place in DISTRIBUTIONS:
        told = tomllib.loads((ROOT / place / "pyproject.toml").read_text())["build-system"]
        for requirement in map(Requirement, told["requires"]):
            assert pinned[canonicalize_name(requirement.name)] in requirement.specifier


@pytest.mark.parametrize("lock", [LOCK, BACKEND_LOCK], ids=lambda path: path.name)
def test_every_version_has_its_hashes(lock: Path) -> None:
    blocks = lock.read_text().replace("\\\n", " ").splitlines()
    for block in blocks:
        if not block.startswith("#"):
            assert re.fullmatch(r"\S+==\S+( +--hash=sha256:[0-9a-f]{64})+", block), block


def _pinned(lock: Path = LOCK) -> dict[str, str]:
    lines = [line for line in lock.read_text().splitlines() if "==" in line]
    pairs = [line.rstrip("\\ ").split("==") for line in lines]
    assert len({name for name, _ in pairs}) == len(pairs), "one version of each"
    return {name: version for name, version in pairs}


def _declared() -> list[Requirement]:
    wanted = []
    for place in DISTRIBUTIONS:
        project = tomllib.loads((ROOT / place / "pyproject.toml").read_text())["project"]
        wanted += [Requirement(line) for line in project["dependencies"]]
        extras = project.get("optional-dependencies", {})
        wanted += [Requirement(line) for name in ("fast", "usb") for line in extras.get(name, ())]
    return [r for r in wanted if r.name.lower() not in OWN]
