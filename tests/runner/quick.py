"""`./run quick`: lint and the pure tests, those of what was changed first. At most a minute."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from tests.runner import budget, stages
from tests.runner.stages import PROCESSORS, ROOT

PURE = (
    "tests/kit",
    "tests/planning",
    "tests/sdk",
    "tests/transport/streams/test_broker.py",
    "tests/transport/link/test_token_bucket.py",
    "tests/transport/link/test_worker_link.py",
    "tests/wheelhouse",
    "tests/test_errors.py",
    "tests/test_layout.py",
    "tests/host/catalogue",
    "tests/host/config",
    "tests/host/mind",
    "tests/host/trust",
)
"""Folders of tests that start no daemon and no worker."""
FILTER = "not daemon and not slow"


def run(arguments: Sequence[str]) -> int:
    """Lint, then test; the exit status."""
    stages.check_places(arguments)
    for words in (["check", "-q"], ["format", "--check", "-q"]):
        status = subprocess.run([sys.executable, "-m", "ruff", *words], cwd=ROOT, check=False)
        if status.returncode:
            return status.returncode
    places = ordered(changed_files())
    slow = (f"--ignore={file}" for file in budget.read().slow_files)
    fewer = "--hypothesis-profile=quick"
    options = (*stages.at_once(PROCESSORS), "-m", FILTER, fewer, *slow, *places, *arguments)
    command = [sys.executable, "-m", "pytest", "-q", *options]
    return subprocess.run(command, cwd=ROOT, check=False).returncode


def ordered(changed: Iterable[str]) -> list[str]:
    """The pure folders, those of changed files first."""
    touched = {tests_of(file) for file in changed}
    return sorted(PURE, key=lambda place: place not in touched)


def tests_of(file: str) -> str:
    """The folder of the tests of a file: `host/nondum/host/mind/x.py` → `tests/host/mind`."""
    parts = Path(file).parts
    if parts[0] == "tests":
        return "/".join(parts[: 3 if parts[1:2] == ("host",) else 2])
    if file.startswith("plugins/sdk/"):
        return "tests/sdk"
    if parts[0] == "host":
        return f"tests/host/{parts[3]}" if len(parts) > 4 else "tests/host"
    return f"tests/{parts[0]}"


def changed_files() -> list[str]:
    """Files that differ from the last commit, and new ones."""
    command = ["git", "status", "--porcelain", "--no-renames", "--untracked-files=all"]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout
    return [line[3:] for line in told.splitlines()]
