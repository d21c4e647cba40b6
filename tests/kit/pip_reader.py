"""What pip tells of a venv, asked by another interpreter, as docs/install.md has it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from packaging.utils import canonicalize_name

from nondum.wheelhouse.format import lock
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.lock import LockedWheel
from nondum.wheelhouse.payload import host_facts
from nondum.wheelhouse.store import venvs


def locked(folder: Path, component: str) -> tuple[LockedWheel, ...]:
    """What the lock of a component in a payload folder selects for this host."""
    name = lock.file_name(component)
    facts = host_facts.probe(folder, reserve_mb=0, confinement=Level.NONE)
    parsed = lock.parse((folder / name).read_text(encoding="utf-8"), name)
    return lock.select(parsed, facts.environment, facts.tags)


def listed(venv: Path) -> dict[str, str]:
    """Distribution → version, by `pip list`."""
    rows = json.loads(_pip("list", "--format", "json", *_path(venv)).stdout)
    return {canonicalize_name(row["name"]): row["version"] for row in rows}


def inspected(venv: Path) -> dict[str, dict[str, Any]]:
    """Distribution → what `pip inspect` tells of it."""
    rows = json.loads(_pip("inspect", *_path(venv)).stdout)["installed"]
    return {canonicalize_name(row["metadata"]["name"]): row for row in rows}


def broken(venv: Path) -> str:
    """What `pip check` finds broken; empty: nothing. The venv's interpreter runs for it."""
    done = _pip("--python", str(venv / "bin/python"), "check", is_checked=False)
    is_sound = done.returncode == 0 and "No broken requirements found" in done.stdout
    return "" if is_sound else done.stdout + done.stderr


def _path(venv: Path) -> tuple[str, str]:
    return "--path", str(venvs.site_packages(venv))


def _pip(*arguments: str, is_checked: bool = True) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-I", "-m", "pip", "--disable-pip-version-check", *arguments]
    # An interpreter of the venv would add to what is compared.
    env = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(command, capture_output=True, text=True, check=is_checked, env=env)
