"""Programs that are called on the way."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

PIP = (sys.executable, "-I", "-m", "pip", "-q", "--disable-pip-version-check")
"""Begins the command of everything that has to do with wheels."""


class BuildFailed(Exception):
    """A package cannot be built; says why in words."""


def call(
    *command: str | Path, env: Mapping[str, str] | None = None, folder: Path | None = None
) -> str:
    """Run a program, in a folder; answers what it wrote. Raises `BuildFailed` with its last
    words."""
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, stdin=subprocess.DEVNULL, env=env, cwd=folder
        )
    except FileNotFoundError as error:
        raise BuildFailed(f"{command[0]} is not there: see docs/install.md") from error
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip()[-4000:]
        raise BuildFailed(f"{' '.join(map(str, command))}\nexited with {done.returncode}:\n{said}")
    return done.stdout
