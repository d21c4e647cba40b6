"""A process of the fork server is what `python -m MODULE …` would be."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.kit.fork_server import Forked, ForkServer, module_of
from tests.kit.running_host import COMMAND, DAEMON, until_ended

SHOW = """
import json, os, signal, sys
from pathlib import Path

print(json.dumps({
    "arguments": sys.argv,
    "name": __name__,
    "path": sys.path[0],
    "folder": os.getcwd(),
    "environment": dict(os.environ),
    "descriptors": sorted(os.readlink(f) for f in Path("/proc/self/fd").iterdir() if f.exists()),
    "group": [os.getpgrp(), os.getsid(0)],
    "signals": [repr(signal.getsignal(n)) for n in sorted(signal.valid_signals())],
    "blocked": sorted(signal.pthread_sigmask(signal.SIG_BLOCK, ())),
    "threads": len(list(Path("/proc/self/task").iterdir())),
}), file=sys.stderr)
"""
WAIT = "import signal, sys; print('runs', file=sys.stderr, flush=True); signal.pause()"


@pytest.fixture(scope="module")
def server() -> Iterator[ForkServer]:
    with ForkServer() as server:
        yield server


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, where modules are found."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def started(server: ForkServer, folder: Path, source: str, *arguments: str) -> Forked:
    """A program that runs in a process of the server."""
    program = folder / "program.py"
    if not program.exists():  # another process may be reading it
        program.write_text(source, encoding="utf-8")
    return server.start(["program", *arguments], stderr=subprocess.PIPE)


def written(process: Forked | subprocess.Popen[bytes]) -> str:
    """What a program writes until it ends."""
    assert process.stderr is not None
    with process.stderr as lines:
        return lines.read().decode()


def test_process_is_the_same_as_one_that_was_started(
    server: ForkServer, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SINCE_THE_SERVER_WAS_STARTED", "yes")
    forked = started(server, folder, SHOW, "one", "two words")
    command = [sys.executable, "-m", "program", "one", "two words"]
    # Without `env`, it would also have what readline sets past `os.environ`.
    with subprocess.Popen(command, stderr=subprocess.PIPE, env=os.environ) as popen:
        assert shown(written(forked)) == shown(written(popen))
    assert forked.wait(60) == 0


def test_process_has_the_environment_that_is_given(server: ForkServer, folder: Path) -> None:
    (folder / "program.py").write_text(SHOW, encoding="utf-8")
    process = server.start(["program"], stderr=subprocess.PIPE, env={"ONLY": "this"})
    assert shown(written(process))["environment"] == {"ONLY": "this"}


def shown(text: str) -> dict[str, Any]:
    """What a program shows, with any pipe for another."""
    found: dict[str, Any] = json.loads(text)
    found["descriptors"] = [name.split(":")[0] for name in found["descriptors"]]
    return found


@pytest.mark.parametrize(
    ("source", "code"),
    [("", 0), ("import sys; sys.exit(3)", 3), ("raise SystemExit('no')", 1), ("1 / 0", 1)],
)
def test_return_code_is_that_of_the_program(
    server: ForkServer, folder: Path, source: str, code: int
) -> None:
    process = started(server, folder, source)
    said = written(process)
    assert process.wait(60) == process.poll() == code
    assert ("ZeroDivisionError" in said) == (source == "1 / 0")


def test_killed_process_is_seen_to_have_been_killed(server: ForkServer, folder: Path) -> None:
    one, other = (started(server, folder, WAIT) for _ in range(2))
    for process in (one, other):
        assert process.stderr is not None
        assert process.stderr.readline() == b"runs\n"
    assert one.poll() is None
    one.kill()
    assert one.wait(60) == -9
    assert other.poll() is None, "another one goes on"
    other.terminate()
    assert other.wait(60) == -15
    for process in (one, other):
        written(process)


def test_processes_end_with_the_server(folder: Path) -> None:
    with ForkServer() as server:
        process = started(server, folder, WAIT)
        assert process.stderr is not None
        assert process.stderr.readline() == b"runs\n"
        os.kill(process.pid, 0)
    until_ended(process.pid)
    written(process)


def test_only_modules_are_run_by_the_server() -> None:
    assert module_of(DAEMON) == ("nondum.cli", "host", "run", "--user")
    assert module_of(COMMAND) is None
    assert module_of(("setarch", "linux32", *DAEMON)) is None
