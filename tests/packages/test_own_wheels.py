"""nondum's own wheels: built by what is locked, and the same wherever and whenever that is done."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.kit.payloads import make_wheel
from tests.packages.checkout import copied
from tests.packages.conftest import EPOCH, ROOT

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300), pytest.mark.short("packages")]
DISTRIBUTIONS = 7
BUILD = """
import sys
from pathlib import Path
from nondum_deb import tree
tree.own_wheels(Path(sys.argv[1]))
"""


def built(checkout: Path, folder: Path, *, umask: int = 0o022, **variables: str) -> dict[str, str]:
    """Build the wheels of a checkout into a folder; hashes by name."""
    folder.mkdir()
    ours = {"PYTHONPATH": str(checkout / "packaging/debian"), "SOURCE_DATE_EPOCH": EPOCH}
    done = subprocess.run(
        [sys.executable, "-P", "-c", BUILD, folder],
        env={**os.environ, **ours, **variables},
        cwd="/",
        umask=umask,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


def test_wheels_are_the_same_wherever_they_are_built(tmp_path: Path) -> None:
    here = copied(tmp_path / "a", umask=0o022, time_s=1_600_000_000)
    there = copied(tmp_path / "b/some where/else", umask=0o077, time_s=1_700_000_000)
    made = built(here, tmp_path / "one")
    assert len(made) == DISTRIBUTIONS
    assert made == built(there, tmp_path / "other", umask=0o077, TZ="Asia/Tokyo", LC_ALL="C")


def test_newer_backends_than_the_locked_one_are_not_taken(tmp_path: Path) -> None:
    index = tmp_path / "index"
    index.mkdir()
    stranger = {"hatchling/__init__.py": "", "hatchling/build.py": "raise SystemExit('newest')\n"}
    make_wheel(index, "hatchling", "99.0", stranger)
    assert len(built(ROOT, tmp_path / "made", PIP_FIND_LINKS=str(index))) == DISTRIBUTIONS
