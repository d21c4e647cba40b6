"""`./run demo` and `./run demo search` are told apart, and explain themselves."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def demo(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "demo", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("arguments", "own", "others"),
    [((), "--shuffle", "--loopback"), (("search",), "--loopback", "--shuffle")],
    ids=["one host", "three hosts"],
)
def test_each_has_help_of_its_own(arguments: tuple[str, ...], own: str, others: str) -> None:
    done = demo(*arguments, "--help")
    assert done.returncode == 0
    assert own in done.stdout
    assert others not in done.stdout
    assert "./run demo search" in done.stdout


@pytest.mark.parametrize(
    "wrong", [("searching",), ("search", "--shuffle", "1"), ("search", "--without", "camera")]
)
def test_what_there_is_not_is_refused(wrong: tuple[str, ...]) -> None:
    done = demo(*wrong)
    assert done.returncode == 2
    assert "usage: ./run demo" in done.stderr
