"""The Debian packages of this checkout, each built once for all that look at it."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EPOCH = "1767225600"
"""One time for all, whatever is committed meanwhile."""
Build = Callable[..., Path]
Package = Callable[[str], Path]


@pytest.fixture(scope="session")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Runs the builder of a checkout, which is this one; answers the folder of what it built."""

    def run(*words: str, checkout: Path = ROOT, umask: int = 0o022, **variables: str) -> Path:
        folder = tmp_path_factory.mktemp("packages")
        command = [sys.executable, "-P", "-m", "nondum_deb", "-o", str(folder), *words]
        ours = {"PYTHONPATH": str(checkout / "packaging/debian"), "SOURCE_DATE_EPOCH": EPOCH}
        surroundings = {**os.environ, **ours, **variables}
        done = subprocess.run(
            command, env=surroundings, capture_output=True, text=True, cwd="/", umask=umask
        )
        assert done.returncode == 0, done.stderr
        return folder

    return run


@pytest.fixture(scope="session")
def package(build: Build) -> Package:
    """The package of an architecture, by Debian's name of it."""

    @functools.cache
    def of(architecture: str) -> Path:
        (deb,) = build("--arch", architecture, "--version", "0.1.0+test1").iterdir()
        return deb

    return of
