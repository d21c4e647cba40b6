"""What state a checkout is in: its commit, and what the paths of a campaign contain."""

from __future__ import annotations

import hashlib
import subprocess
from collections.abc import Sequence
from pathlib import Path

from tests.campaign.page import DIRTY

OWN = ":(exclude)docs/reliability"
"""Where campaigns write."""


def commit(root: Path) -> str:
    """Short hash of the present commit, with `+` if the working tree differs from it.

    Pages that campaigns write do not count: the first of some would make the next one's tree
    differ.
    """
    short = _git(root, "rev-parse", "--short=10", "HEAD").strip()
    return short + (DIRTY if _git(root, "status", "--porcelain", "--", ".", OWN) else "")


def contents(root: Path, paths: Sequence[str]) -> str:
    """A hash of all files that pathspecs of git lead to, committed or not."""
    listed = _git(
        root, "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", *paths
    )
    told = hashlib.sha256()
    for name in sorted(set(listed.split("\0")) - {""}):
        file = root / name
        told.update(f"{name}\0".encode())
        if file.is_file():
            told.update(hashlib.sha256(file.read_bytes()).digest())
    return told.hexdigest()[:16]


def _git(root: Path, *words: str) -> str:
    command = ["git", *words]
    return subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout
