"""Running an integrator's program: in a separate process group, with a deadline."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import subprocess
from collections.abc import Mapping, Sequence

from nondum.sdk.errors import InstallFailed, Problem
from nondum.sdk.frozen import frozen

log = logging.getLogger(__name__)

OUTPUT_BYTES = 4096
"""Of what it writes, so much is kept."""
_INHERITED = ("PATH", "HOME", "LANG", "LC_ALL", "XDG_RUNTIME_DIR")
_END_S = 1.0
"""How long a killed program, and what it has left behind, is waited for."""


@frozen
class Ended:
    """How a program ended."""

    status: int | None
    """Its exit status, negative for a signal; None: it was killed at its deadline."""
    output: str
    """The beginning of what it wrote."""


async def run(
    command: Sequence[str], environment: Mapping[str, str], data: bytes, deadline_s: float
) -> Ended:
    """Run a program with `data` at its standard input, until it ends; then, or at its deadline, all
    that is left of its process group is killed. Cancelling does the same. Raises `OSError`."""
    inherited = {name: os.environ[name] for name in _INHERITED if name in os.environ}
    starting = asyncio.ensure_future(
        asyncio.get_running_loop().subprocess_exec(
            _Talk,
            *command,
            stderr=subprocess.STDOUT,
            env={**inherited, **environment},
            start_new_session=True,
        )
    )
    try:  # cancelled with half of its pipes connected, asyncio would wait for ever
        transport, talk = await asyncio.shield(starting)
    except asyncio.CancelledError:
        await asyncio.wait([starting])
        if starting.exception() is None:
            await _end(*starting.result())
        raise
    _tell(transport, data)
    status: int | None = None
    try:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(deadline_s):
                await talk.exited.wait()
            status = transport.get_returncode()
    finally:
        await asyncio.shield(_end(transport, talk))
    return Ended(status, talk.output.decode(errors="replace").strip())


async def succeed(
    command: Sequence[str],
    environment: Mapping[str, str],
    data: bytes,
    deadline_s: float,
    *,
    fix: str,
) -> str:
    """Run a program that must end well; the beginning of what it wrote.

    Raises `InstallFailed` (PROGRAM_FAILED, PROGRAM_OVERDUE), with `fix` as what to do.
    """
    try:
        ended = await run(command, environment, data, deadline_s)
    except OSError as error:
        text = f"cannot be run ({error.strerror})"
        raise _failed("PROGRAM_FAILED", text, command, fix) from error
    for line in ended.output.splitlines():
        log.info("%s: %s", command[0], printable(line))
    if ended.status is None:
        text = f"was killed: it had not ended after {deadline_s:g} s"
        raise _failed("PROGRAM_OVERDUE", text, command, fix)
    if ended.status != 0:
        raise _failed("PROGRAM_FAILED", f"ended with status {ended.status}", command, fix)
    return ended.output


def printable(text: str) -> str:
    """Strangers' words, as arguments and log lines can carry them.

    >>> printable("a\\x00b\\nc")
    'a b c'
    """
    return "".join(letter if letter.isprintable() else " " for letter in text)


def _failed(code: str, text: str, command: Sequence[str], fix: str) -> InstallFailed:
    return InstallFailed(Problem(code, text, where=command[0], fix=fix))


class _Talk(asyncio.SubprocessProtocol):
    """Reads the output of a program until the program exits. Processes that inherited its output
    may still run then; streams of asyncio would wait for those, too."""

    def __init__(self) -> None:
        self.exited, self.closed = asyncio.Event(), asyncio.Event()
        self.output = bytearray()

    def pipe_data_received(self, fd: int, data: bytes) -> None:
        """Keep the beginning."""
        self.output.extend(data[: max(0, OUTPUT_BYTES - len(self.output))])

    def process_exited(self) -> None:
        """It has ended."""
        self.exited.set()

    def connection_lost(self, exc: Exception | None) -> None:
        """The program has exited, and its output is closed."""
        self.closed.set()


def _tell(transport: asyncio.SubprocessTransport, data: bytes) -> None:
    stdin = transport.get_pipe_transport(0)
    assert isinstance(stdin, asyncio.WriteTransport)
    stdin.write(data)
    stdin.write_eof()


async def _end(transport: asyncio.SubprocessTransport, talk: _Talk) -> None:
    """Kill what is left of the group; what has left the group is not waited for."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(transport.get_pid(), signal.SIGKILL)
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(_END_S):
            await talk.closed.wait()
    transport.close()
