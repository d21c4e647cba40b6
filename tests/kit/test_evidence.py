"""A test that fails shows what the daemons wrote that ran while it ran."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

TESTS = """
import pytest
from tests.kit import evidence

class Host:
    def __init__(self, work, name):
        self.log_file, self.name, self.runs = work / "daemon.log", name, True
        self.log_file.write_text(f"{name} says why")
        evidence.keep(self)

@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    return Host(tmp_path_factory.mktemp("shared"), "mule")

def test_passes(shared):
    pass

def test_fails(shared, tmp_path):
    Host(tmp_path, "rover").runs = False
    assert not "it holds"

def test_fails_later(shared):
    assert not "it still holds"
"""


def test_failure_shows_the_logs_of_its_hosts(tmp_path: Path) -> None:
    (tmp_path / "test_some.py").write_text(TESTS, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-p", "tests.kit.evidence", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*command, "--rootdir", tmp_path, tmp_path], capture_output=True, text=True
    )
    assert done.returncode == 1, done.stdout
    _, first, second = done.stdout.split("___ test_")
    assert "mule says why" in first
    assert "rover says why" in first
    assert "mule says why" in second
    assert "rover says why" not in second, "it had ended before"
    assert "/daemon.log ends with" in first
