"""A worker's process and its group: when it ends, and how it is ended."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from nondum.host.sandbox.cgroups import Cgroup
from nondum.host.workers.init_link import InitLink, OpenFiles, node_of

DETACH_S = 2.0
"""How long a killed process is waited for; one in uninterruptible sleep may never end."""


class WorkerProcess:
    """A started process that leads a session. Make it on the loop; it reaps the process."""

    def __init__(
        self,
        popen: subprocess.Popen[bytes],
        cgroup: Cgroup | None = None,
        init: InitLink | None = None,
        user: int | None = None,
    ) -> None:
        """`init`, which it takes over, is the link to the init of a worker's sandbox.

        Raises `OSError` when its end cannot be watched; the link is still the caller's then.
        """
        self.user = user
        """The user of the machine that it is, if not the host's."""
        self._popen = popen
        self._init = init
        self.cgroup = cgroup
        """Holds the process and all that it starts; `end` ends the cgroup, too."""
        self.exited: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        """Its exit status, negative for the signal that ended it."""
        self._pidfd = os.pidfd_open(popen.pid)
        try:
            asyncio.get_running_loop().add_reader(self._pidfd, self._on_exit)
        except OSError:
            os.close(self._pidfd)
            raise

    @property
    def pid(self) -> int:
        """The worker's id, as soon as it is known; until then that of what makes its sandbox."""
        inner = self._init.worker if self._init is not None else None
        return inner if inner is not None else self._popen.pid

    @property
    def outputs(self) -> tuple[IO[bytes], IO[bytes]]:
        """Its standard output and standard error, to be read and closed by the caller."""
        assert self._popen.stdout is not None and self._popen.stderr is not None
        return self._popen.stdout, self._popen.stderr

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to the whole group, if any of it is left."""
        if self._popen.returncode is None:  # from then on the id may be somebody else's
            inner = self._init.worker if self._init is not None else None
            if inner is not None:  # its sandbox and init only end, by themselves or by SIGKILL
                _signal_group(inner, number)
            if inner is None or number is signal.SIGKILL:
                _signal_group(self._popen.pid, number)

    def node(self, need: str, node: str) -> str:
        """The path at which it finds a device that it was granted."""
        return node if self._init is None else node_of(need)

    async def grant(self, need: str, node: str, own: str) -> None:
        """Let it have a device, under the device's own name too, where it has a sandbox.

        Raises `WorkerFailed` (DEVICE_REFUSED).
        """
        if self._init is not None:
            await self._init.grant(need, node, own)

    async def revoke(self, need: str) -> None:
        """Take a device away."""
        if self._init is not None:
            await self._init.revoke(need)

    async def open_files(self) -> OpenFiles | None:
        """What its processes have open, where the host cannot look at that by itself."""
        if self._init is None or self.user is None or os.geteuid() == 0:
            return None
        return await self._init.open_files()

    async def wait(self, timeout_s: float) -> bool:
        """Wait for the exit at most so long; answer whether it came."""
        await asyncio.wait([self.exited], timeout=timeout_s)
        return self.exited.done()

    async def end(self, term_s: float) -> bool:
        """SIGTERM, then after `term_s` SIGKILL, to the group; answer whether it is gone."""
        if term_s > 0:
            self.signal(signal.SIGTERM)
            if await self.wait(term_s):
                return True
        self.signal(signal.SIGKILL)
        return await self.wait(DETACH_S)

    def _on_exit(self) -> None:
        asyncio.get_running_loop().remove_reader(self._pidfd)
        os.close(self._pidfd)
        # Its children in the group go with it. It is not reaped yet, so the id is still its own.
        self.signal(signal.SIGKILL)
        status = self._popen.wait()
        if self._init is None:
            self.exited.set_result(status)
            return
        status = 128 - status if status > 128 else status  # as shells and bwrap(1) tell it
        init_pidfd = self._init.take_pidfd()
        self._init.close()
        if init_pidfd is None:
            self.exited.set_result(status)
            return
        loop = asyncio.get_running_loop()
        try:  # what made the sandbox may end before what is in it
            loop.add_reader(init_pidfd, self._on_init_ended, init_pidfd, status)
        except OSError:  # as where it never said who it is
            self._on_init_ended(init_pidfd, status)

    def _on_init_ended(self, pidfd: int, status: int) -> None:
        asyncio.get_running_loop().remove_reader(pidfd)
        os.close(pidfd)
        self.exited.set_result(status)


def _signal_group(leader: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(leader, number)


def names_of(need: str, nodes: Sequence[Mapping[str, Any]]) -> list[str]:
    """By which names a worker finds the nodes of a device: the first by that of its need.

    >>> names_of("eye", [{"node": "/dev/video0"}, {"node": "/dev/video1"}])
    ['eye', 'eye.video1']
    """
    return [need, *(f"{need}.{Path(each['node']).name}" for each in nodes[1:])]


def exit_words(status: int) -> str:
    """An exit status in words.

    >>> exit_words(3), exit_words(-11)
    ('exited with status 3', 'was ended by SIGSEGV')
    """
    if status >= 0:
        return f"exited with status {status}"
    try:
        return f"was ended by {signal.Signals(-status).name}"
    except ValueError:
        return f"was ended by signal {-status}"
