"""The session of docs/first-payload.md, typed as it is printed, prints what it shows."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.kit.until import until

ROOT = Path(__file__).parents[2]

pytestmark = [pytest.mark.daemon, pytest.mark.timeout(300)]


def session() -> Iterator[tuple[str, str]]:
    """Every command of the page's terminals, and what it shows of its output."""
    text = (ROOT / "docs/first-payload.md").read_text(encoding="utf-8")
    for block in re.findall(r"^```console\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        yield from re.findall(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", block, re.MULTILINE)


def is_as_shown(shown: str, printed: str) -> bool:
    """Whether an output is the one on the page, where `…` and decimal numbers stand for any."""
    pattern = re.escape(shown).replace("…", ".*")
    pattern = re.sub(r"\d+\\\.\d+", r"\\d+\\.\\d+", pattern)
    # Past a minute pytest says it twice: `70.36s (0:01:10)`.
    pattern = pattern.replace(r"\d+\.\d+s", r"\d+\.\d+s(?: \([\d:]+\))?")
    return re.fullmatch(pattern, printed, re.DOTALL) is not None


@pytest.fixture
def folder() -> Iterator[Path]:
    """One with a short name, as homes have: the path of a socket may have 107 characters."""
    with tempfile.TemporaryDirectory(prefix="nd-") as name:
        yield Path(name)


@pytest.fixture
def environment(folder: Path) -> dict[str, str]:
    """A checkout, a user's home, and the environment that the set-up makes."""
    (folder / "plugins").symlink_to(ROOT / "plugins")
    (folder / "home").mkdir()
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("XDG_", "PYTEST_", "COLUMNS"))  # readline sets the last
    }
    return kept | {"HOME": str(folder / "home"), "PATH": path, "PYTHONUNBUFFERED": "1"}


def test_the_session_goes_as_it_is_printed(folder: Path, environment: dict[str, str]) -> None:
    host: subprocess.Popen[str] | None = None
    try:
        for command, shown in session():
            if "activate" in command:
                continue
            if command.startswith("nondum host run"):
                host = start(command, shown, folder, environment)
            else:
                follow(command, shown, folder, environment)
        assert host is not None
    finally:
        if host is not None:
            host.terminate()
            host.communicate()


def start(command: str, shown: str, folder: Path, env: dict[str, str]) -> subprocess.Popen[str]:
    """Run what keeps running, until it has said what the page shows."""
    host = subprocess.Popen(
        ["bash", "-c", f"exec {command}"],
        cwd=folder,
        env=env,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert host.stdout is not None
    printed = "".join(host.stdout.readline() for _ in shown.splitlines())
    assert is_as_shown(shown, printed), printed
    return host


def follow(command: str, shown: str, folder: Path, env: dict[str, str]) -> None:
    """Run a command; where a host has yet to get there, ask again as a person would."""
    asks = command.startswith(("nondum goals", "nondum components", "nondum why"))
    printed = ""

    def is_there() -> bool:
        nonlocal printed
        done = subprocess.run(
            ["bash", "-c", command],
            cwd=folder,
            env=env,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        printed = done.stdout
        return done.returncode == 0 and is_as_shown(shown, printed)

    if asks:
        until(f"$ {command}", is_there, evidence=lambda: printed)
    else:
        assert is_there(), f"$ {command}\n{printed}"
