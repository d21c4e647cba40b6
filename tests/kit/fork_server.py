"""Programs forked from a process that has imported them, in place of a start of Python for each.

    process = fork_server().start(["nondum.cli", "host", "run", "--user"])

A process of the fork server is what `python -m MODULE …` would be, with its own arguments,
environment, folder and standard streams; it has no other descriptors, and ends as a program ends.
Two differ: /proc shows the fork server's command line and first environment, and the parent is the
fork server. What it has started is killed when the process that asked for it ends.

The process that forks has one thread and no loop: this module, run as a program.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import importlib
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

from tests.kit.evidence import logged

from nondum.cli.installed_commands import installed_commands
from nondum.cli.root import COMMANDS
from nondum.host.forking.fork_server import ANSWER_BYTES, answer, ask, serve
from nondum.host.service.malloc import keep_what_is_loaded

ROOT = Path(__file__).parent.parent.parent
PATIENCE_S = 90.0
IMPORTED = (
    "nondum.host.app",
    "nondum.host.peers.peer_services",
    *(f"nondum.cli.{module}" for module, _ in COMMANDS.values()),
    *(entry.module for entry in installed_commands().values()),
)
"""What daemons and commands import, and the fork server before them."""

Command = Sequence[str]
"""A module that is a program, and its arguments."""


class Forked:
    """A process of the fork server; the methods are those of `subprocess.Popen`."""

    def __init__(
        self, pid: int, descriptor: int, status: int, streams: Sequence[IO[Any] | None]
    ) -> None:
        """`descriptor` is its pidfd; its return code can be read from `status`."""
        self.pid = pid
        self.stdin, self.stdout, self.stderr = streams
        self.returncode: int | None = None
        self._descriptor, self._status = descriptor, status
        self._ended = threading.Lock()

    def poll(self) -> int | None:
        """The return code, negative for a signal; None while it runs."""
        return self._ends_within(0)

    def wait(self, timeout: float | None = None) -> int:
        """The return code, once it has ended. Raises `subprocess.TimeoutExpired`."""
        code = self._ends_within(timeout)
        if code is None:
            raise subprocess.TimeoutExpired(f"process {self.pid}", timeout or 0)
        return code

    def send_signal(self, number: int) -> None:
        """Send it a signal, if it runs."""
        with self._ended:
            if self.returncode is None:
                with contextlib.suppress(ProcessLookupError):
                    signal.pidfd_send_signal(self._descriptor, number)

    def terminate(self) -> None:
        """Ask it to end."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """End it."""
        self.send_signal(signal.SIGKILL)

    def communicate(self) -> tuple[Any, Any]:
        """What else it writes to its output and its errors, once it has ended; closes its pipes."""
        if self.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self.stdin.close()
        said = [stream and stream.read() for stream in (self.stdout, self.stderr)]
        for stream in (self.stdout, self.stderr):
            if stream is not None:
                stream.close()
        self.wait()
        return said[0], said[1]

    def _ends_within(self, timeout_s: float | None) -> int | None:
        with self._ended:
            if self.returncode is not None:
                return self.returncode
        ready = select.poll()
        ready.register(self._status, select.POLLIN)
        if not ready.poll(None if timeout_s is None else timeout_s * 1000):
            return None
        with self._ended:
            if self.returncode is None:
                said = os.read(self._status, ANSWER_BYTES)
                assert said, "the fork server has ended"
                self.returncode = int(said)
                os.close(self._status)
                os.close(self._descriptor)
            return self.returncode


_MODES = {(True, True): "w", (True, False): "wb", (False, True): "r", (False, False): "rb"}
"""(Whether it is written to, whether it is text) → how a pipe is opened."""


class ForkServer:
    """Starts daemons, several at once if need be. Use it as a context, or close it."""

    def __init__(self) -> None:
        self._one_request = threading.Lock()
        self._channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "tests.kit.fork_server", str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                cwd=ROOT,
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End it, and kill what it has started and still runs."""
        self._channel.close()
        self._process.wait()

    def start(
        self,
        command: Command,
        *,
        stdin: int | None = None,
        stdout: int | None = None,
        stderr: int | None = None,
        text: bool = False,
        env: Mapping[str, str] | None = None,
    ) -> Forked:
        """Start `python -m command…` in this folder, with this environment unless `env` is another.

        Each stream is a descriptor, or `subprocess.PIPE`; `text` makes pipes of text.
        """
        streams: list[IO[Any] | None] = []
        with contextlib.ExitStack() as ours:
            theirs: list[int] = []
            for number, wanted in enumerate((stdin, stdout, stderr)):
                if wanted != subprocess.PIPE:
                    streams.append(None)
                    theirs.append(number if wanted is None else wanted)
                    continue
                reader, writer = os.pipe()
                mine, its = (writer, reader) if number == 0 else (reader, writer)
                streams.append(os.fdopen(mine, _MODES[number == 0, text]))
                theirs.append(its)
                ours.callback(os.close, its)
            status, of_server = os.pipe()
            ours.callback(os.close, of_server)
            environment = dict(os.environ if env is None else env)
            pid, descriptor = self._ask(command, [*theirs, of_server], environment)
        return Forked(pid, descriptor, status, streams)

    def _ask(
        self, command: Command, descriptors: list[int], environment: dict[str, str]
    ) -> tuple[int, int]:
        """Have a process forked; its pid and pidfd."""
        request = json.dumps(
            {"command": list(command), "folder": str(Path.cwd()), "environment": environment}
        )
        with self._one_request:
            ask(self._channel, request.encode(), descriptors)
            return answer(self._channel)


def fork_server() -> ForkServer:
    """The fork server of this process."""
    return _fork_server_of(os.getpid())


@functools.cache
def _fork_server_of(pid: int) -> ForkServer:
    server = ForkServer()
    atexit.register(server.close)
    return server


def module_of(program: Sequence[str]) -> Command | None:
    """What the fork server is to run for a program; None if that is not `python -m …`."""
    head, tail = tuple(program[:2]), program[2:]
    return tail if head == (sys.executable, "-m") else None


class Nursery:
    """Daemons that are to die, one after the other. Use it as a context."""

    def __enter__(self) -> Self:
        self._server = ForkServer()
        return self

    def __exit__(self, *error: Any) -> None:
        self._server.close()

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
        code, was_late = self._run(orders, log, at_birth, late_s or PATIENCE_S)
        if was_late and late_s is None:
            raise TimeoutError(f"it did not end within {PATIENCE_S:g} s\n{logged(log, start)}")
        if expect is not None and code != expect:
            text = f"the daemon ended with {code} instead of {expect}"
            raise AssertionError(f"{text}\n{logged(log, start)}")
        return code

    def _run(
        self, orders: dict[str, Any], log: Path, at_birth: Callable[[int], None], late_s: float
    ) -> tuple[int, bool]:
        """The return code, and whether the daemon's time was over."""
        with log.open("ab") as lines:
            command = ["tests.faults.daemon", json.dumps(orders)]
            process = self._server.start(command, stderr=lines.fileno())
        late = threading.Timer(late_s, process.kill)
        late.start()
        try:
            at_birth(process.pid)
            code = process.wait()
        finally:
            was_late = not late.is_alive()
            late.cancel()
        return code, was_late


# What follows runs in the fork server.


def _become(command: Command, folder: str, environment: dict[str, str]) -> None:
    """Be the program that was asked for."""
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    module, *arguments = command
    sys.path[0], sys.argv[1:] = folder, arguments
    runpy.run_module(module, run_name="__main__", alter_sys=True)


def main() -> None:
    """Serve the client at the socket whose descriptor is given."""
    for module in IMPORTED:
        importlib.import_module(module)
    keep_what_is_loaded()  # else each process, at its end, looks through all of it
    if request := serve(socket.socket(fileno=int(sys.argv[1]))):
        _become(**json.loads(request))


if __name__ == "__main__":
    main()
