"""Starts the process of the links, and ends it."""

from __future__ import annotations

import os
import socket
import subprocess
import sys

from nondum.host.workers.process import WorkerProcess, exit_words

MEMORY_BYTES = 512 * 1024**2
"""Of its data (setrlimit(2), RLIMIT_DATA). It begins with some 35 MB. A connection whose peer reads
nothing may have 40 MB more: `HIGH_WATER` and `WINDOW` of the longest messages; one whose messages
the daemon does not take in, 32 MB."""


class LinksProcess:
    """One that runs."""

    def __init__(self, pipe: socket.socket, memory: int = MEMORY_BYTES) -> None:
        """Start it with its end of the pipe, on the running loop. Raises `OSError`."""
        self._process = WorkerProcess(_started(pipe.fileno(), memory))

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    async def ended(self, grace_s: float) -> str:
        """Wait for its end, and bring it about when that takes longer; how it ended."""
        if not await self._process.wait(grace_s) and not await self._process.end(0):
            return "does not end"
        return exit_words(self._process.exited.result())


def _started(pipe: int, memory: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-I", "-P", "-m", "nondum.host.peers.links"]
    return subprocess.Popen(
        [*command, str(pipe), str(os.getpid()), str(memory)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        pass_fds=(pipe,),
        start_new_session=True,
    )
