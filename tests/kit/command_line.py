"""Runs the command `nondum` in a process, also in a pseudo-terminal: exit code and output."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from demo.robot import NONDUM
from tests.kit.fork_server import fork_server, module_of
from tests.kit.until import PATIENCE_S


@dataclass(frozen=True)
class Ran:
    """What one run of the command line came to."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """Standard output, parsed."""
        return json.loads(self.out)

    def ok(self) -> Ran:
        """This, if the command did what it was asked for."""
        assert self.code == 0, (self.code, self.out, self.err)
        assert not self.err, self.err
        return self

    def refused(self, code: int, words: str) -> Ran:
        """This, if the command refused with that exit code and those words, without a traceback."""
        assert "Traceback" not in self.err, self.err
        assert self.code == code, (self.code, self.out, self.err)
        assert words in self.err, self.err
        return self


def nondum(*arguments: str | Path, **environment: str) -> Ran:
    """Run `nondum` to its end in a process of the fork server, which has imported it."""
    own = [name for name in environment if name.startswith("PYTHON")]
    assert not own, f"only a new interpreter reads {own}: use `in_new_interpreter`"
    module = module_of(command(*arguments))
    assert module is not None
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = fork_server().start(
            module,
            stdout=out.fileno(),
            stderr=err.fileno(),
            env=clean_environment() | environment,
        )
        try:
            code = process.wait(PATIENCE_S)
        finally:
            process.kill()
        return Ran(code, _written(out), _written(err))


def in_new_interpreter(*arguments: str | Path, **environment: str) -> Ran:
    """Run `nondum` to its end with the whole start of Python."""
    done = subprocess.run(
        command(*arguments),
        capture_output=True,
        text=True,
        env=clean_environment() | environment,
        timeout=PATIENCE_S,
        check=False,
    )
    return Ran(done.returncode, done.stdout, done.stderr)


def _written(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode()


def in_terminal(*arguments: str | Path, **environment: str) -> str:
    """Run `nondum` in a terminal, and give everything that it shows there."""
    code, shown = at_terminal(*arguments, typed="", environment=environment)
    assert code == 0, shown
    return shown


def at_terminal(
    *arguments: str | Path, typed: str, environment: Mapping[str, str] | None = None
) -> tuple[int, str]:
    """Run `nondum` in a terminal where a person types; give its code and all that it shows."""
    ours, theirs = pty.openpty()
    os.write(ours, typed.encode())
    process = subprocess.Popen(
        command(*arguments),
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env=clean_environment() | {"TERM": "xterm"} | dict(environment or {}),
    )
    os.close(theirs)
    shown = b""
    with process:
        while some := _read(ours):
            shown += some
    os.close(ours)
    return process.returncode, shown.decode()


def _read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 65536)
    except OSError:  # EIO: no process has the other end open any more (pty(7))
        return b""


def command(*arguments: str | Path) -> list[str]:
    """The command line that runs `nondum`."""
    return [*NONDUM, *map(str, arguments)]


def clean_environment() -> dict[str, str]:
    """This process's environment, less what would change what is printed, or who answers."""
    changing = {"NONDUM_CONTROL", "COLUMNS", "NO_COLOR", "FORCE_COLOR"}
    return {key: value for key, value in os.environ.items() if key not in changing}
