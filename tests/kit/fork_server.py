"""Where daemons are born that are to die: forked, with everything imported, instead of started.

    with Nursery() as nursery:
        ended = nursery.run({"root": …, "kill": …})

The process that forks has one thread and no loop: this module, run as a program.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Self

ROOT = Path(__file__).parent.parent.parent
PATIENCE_S = 90.0
LONGEST_LOG = 8000
"""Bytes of a log that a message shows."""


class Nursery:
    """The other end: daemons one after the other. Use it as a context."""

    def __init__(self) -> None:
        self._one_at_a_time = threading.Lock()

    def __enter__(self) -> Self:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.kit.fork_server"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._process.kill()
        self._process.communicate()

    def run(
        self,
        orders: dict[str, Any],
        at_birth: Callable[[int], None] = lambda pid: None,
        *,
        late_s: float | None = None,
        expect: int | None = None,
    ) -> int:
        """Run a daemon to its end; its return code, negative for a signal.

        `at_birth` is called with its pid. It is killed when its time is over. Raises `TimeoutError`
        then, unless `late_s` says that this is meant; and `AssertionError` for another return code
        than the expected one. Both say what this daemon logged.
        """
        log = Path(orders["root"], "log")
        start = log.stat().st_size if log.exists() else 0
        code, was_late = self._run(orders, at_birth, late_s or PATIENCE_S)
        if was_late and late_s is None:
            raise TimeoutError(f"it did not end within {PATIENCE_S:g} s\n{logged(log, start)}")
        if expect is not None and code != expect:
            text = f"the daemon ended with {code} instead of {expect}"
            raise AssertionError(f"{text}\n{logged(log, start)}")
        return code

    def _run(
        self, orders: dict[str, Any], at_birth: Callable[[int], None], late_s: float
    ) -> tuple[int, bool]:
        """The return code, and whether the daemon's time was over."""
        with self._one_at_a_time:
            assert self._process.stdin is not None  # both are pipes
            assert self._process.stdout is not None
            self._process.stdin.write(json.dumps(orders) + "\n")
            self._process.stdin.flush()
            pid = int(self._process.stdout.readline())
            late = threading.Timer(late_s, lambda: _kill(pid))
            late.start()
            try:
                at_birth(pid)
                code = int(self._process.stdout.readline())
            finally:
                was_late = not late.is_alive()
                late.cancel()
            return code, was_late


def logged(log: Path, start: int = 0) -> str:
    """The end of a log, from a position on, as far as a person reads it."""
    with contextlib.suppress(FileNotFoundError), log.open("rb") as file:
        file.seek(max(start, log.stat().st_size - LONGEST_LOG))
        said = file.read().decode(errors="replace").rstrip()
        return f"{log} ends with:\n{said}" if said else f"{log}: nothing was logged"
    return f"{log} was never made"


def _kill(pid: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


def _serve() -> None:
    from tests.faults import daemon

    for line in sys.stdin:
        orders = json.loads(line)
        pid = os.fork()
        if pid == 0:
            _live(daemon.main, orders)
        print(pid, flush=True)  # noqa: T201  # that is how it answers
        _, status = os.waitpid(pid, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)  # noqa: T201


def _live(main: Any, orders: dict[str, Any]) -> None:
    """In the child: never returns."""
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    log = os.open(f"{orders['root']}/log", os.O_CREAT | os.O_WRONLY | os.O_APPEND | os.O_CLOEXEC)
    os.dup2(log, 2)
    code = 1
    try:
        asyncio.run(main(orders))
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    _serve()
