"""An interpreter that waits to become a worker, with the standard library that workers need loaded.

Starting one costs more than anything else that is done for a known payload, and most of that is
the same for all workers: it is done before anybody waits for it.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import json
import os
import signal
import socket
import struct
import subprocess
from collections.abc import Collection, Mapping
from typing import IO, Any

from nondum.host.core.printable import printable
from nondum.host.core.shielded import until_done
from nondum.host.sandbox.cgroups import Cgroup, CgroupLimits, Cgroups
from nondum.host.sandbox.helper import privileged
from nondum.host.sandbox.levels.bubblewrap import Ground
from nondum.host.sandbox.levels.users import NewNamespace
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.init_link import CREDENTIALS, InitLink
from nondum.host.workers.process import WorkerProcess
from nondum.host.workers.spec import Limits

PLACEHOLDER = "NONDUM_PLACEHOLDER"
"""Environment variable whose memory the mark of the worker overwrites (see `launcher.py`)."""
PLACEHOLDER_BYTES = 2048
OWNER = "NONDUM_SPARE_OF"
"""Environment variable of interpreters that have not become a worker: whose they are."""
SAID_BYTES = 64 * 1024
_DESCRIPTOR = struct.Struct("@i")


class Spare:
    """A started interpreter. It ends when it is closed, or with the thread that started it."""

    def __init__(
        self,
        confinement: Confinement,
        ground: Ground,
        owner: str = "",
    ) -> None:
        """Start it; `owner`, if any, tells whose it is. Raises `OSError`."""
        self.ground = ground
        self.cgroup: Cgroup | None = None
        self.said = ""
        """The last line that it said before it ended without having become a worker."""
        self._has_init = confinement.has_init
        self._namespace: NewNamespace | None = None
        self._orders, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        if self._has_init:  # whose a message is comes with it
            self._orders.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        try:
            with theirs:
                if confinement.has_users:
                    self._namespace = NewNamespace()
                self.popen = self._begin(confinement, theirs.fileno(), owner)
        except OSError:
            self._orders.close()
            if self._namespace is not None:
                self._namespace.close()
            raise

    @classmethod
    async def in_cgroup(
        cls,
        confinement: Confinement,
        ground: Ground,
        cgroups: Cgroups | None,
        owner: str,
        startup_s: float,
    ) -> Spare:
        """Start one in a separate cgroup, if there are cgroups, see `settle`. Raises `OSError`.

        The kernel takes some 20 ms to put a process into a control group: a thread waits for it.
        """
        spare = cls(confinement, ground, owner)
        if cgroups is not None or confinement.has_users:
            settling = asyncio.create_task(asyncio.to_thread(spare.settle, startup_s, cgroups))
            try:
                await until_done(settling)
                settling.result()
            except BaseException:
                await spare.end()
                raise
        return spare

    def settle(self, startup_s: float, cgroups: Cgroups | None = None) -> None:
        """Give it a cgroup, and map the users of its sandbox, if it is to have any: then it has
        been started. Blocks.

        Call it once. Raises `OSError`; `TimeoutError` if it has not been after `startup_s`.
        """
        if cgroups is not None:
            self.cgroup = cgroups.make("worker", CgroupLimits())
            self.cgroup.add(self.popen.pid)
        if self._namespace is not None:
            namespace, self._namespace = self._namespace, None
            namespace.map_users(startup_s)

    def serves(self, ground: Ground) -> bool:
        """Whether it is there still, and stands on that ground."""
        return self.ground == ground and self.popen.poll() is None

    def limit(self, limits: Limits) -> None:
        """Set what it may use, before it becomes a worker. Raises `OSError`."""
        if self.cgroup is not None:
            self.cgroup.limit(limits.of_cgroup())

    def become(
        self, parameters: Mapping[str, Any], link: socket.socket, ruleset: int | None
    ) -> bool:
        """Have it become a worker on its end of a link; answer whether it could be told.

        From then on it is the caller's, see `process`; else it is still to be closed. See
        `bootstrap.py` for the parameters. Raises `OSError` (ETOOMANYREFS) when no descriptor can be
        sent now.
        """
        descriptors = [link.fileno(), *([] if ruleset is None else [ruleset])]
        try:
            socket.send_fds(self._orders, [json.dumps(parameters).encode()], descriptors)
        except OSError as error:
            if error.errno == errno.ETOOMANYREFS:
                raise
            return False
        return True

    def map_scratch(self, user: int, startup_s: float) -> None:
        """Map its scratch folder, which it sends a mount of, to a user in its sandbox. Blocks.

        Call it after `become`. Raises `OSError`, `TimeoutError` if it does not send it within
        `startup_s`: a slow host is still loading the interpreter. Then it is still to be closed.
        """
        self._orders.settimeout(startup_s)
        ancillary = socket.CMSG_SPACE(CREDENTIALS.size) + socket.CMSG_SPACE(_DESCRIPTOR.size)
        _, more, _, _ = self._orders.recvmsg(SAID_BYTES, ancillary)
        sent = [value for _, kind, value in more if kind == socket.SCM_RIGHTS]
        if not sent:
            raise ConnectionResetError("it ended before its scratch folder was there")
        (mount,) = _DESCRIPTOR.unpack(sent[0])
        try:
            privileged().map_folder(mount, user)
        finally:
            os.close(mount)
        self._orders.send(b"mapped")

    async def scratch_mapped(self, user: int, startup_s: float) -> None:
        """`map_scratch` without holding up the loop.

        If it is cancelled, it kills the process and waits for the thread. Whatever it raises, the
        caller closes this spare afterwards.
        """
        mapping = asyncio.create_task(asyncio.to_thread(self.map_scratch, user, startup_s))
        try:
            await asyncio.wait([mapping])
        except asyncio.CancelledError:
            self._kill()  # or a slow one would be waited for
            try:
                await until_done(mapping)
            finally:
                mapping.exception()  # read, or asyncio logs it as never retrieved
            raise
        mapping.result()

    def process(self, user: int | None = None) -> WorkerProcess:
        """The worker that it has become, as that user if not as the host's.

        Call it once, on the loop. Raises `OSError`; then it is still to be closed.
        """
        if self._has_init:
            init = InitLink(self._orders)
            try:
                return WorkerProcess(self.popen, self.cgroup, init, user)
            except OSError:
                init.close()
                raise
        self._orders.close()
        return WorkerProcess(self.popen, self.cgroup, user=user)

    async def end(self) -> None:
        """`close` it without holding up the loop, also if the caller is cancelled meanwhile."""
        await until_done(asyncio.create_task(asyncio.to_thread(self.close)))

    def close(self) -> None:
        """End it unused. Blocks until it has ended."""
        self._orders.close()
        if self._namespace is not None:
            self._namespace.close()
        self._kill()
        self.popen.wait()
        self.said = _last_line(self.popen.stderr) or self.said
        for pipe in (self.popen.stdout, self.popen.stderr):
            if pipe is not None:
                pipe.close()
        if self.cgroup is not None:
            self.cgroup.end()

    def _kill(self) -> None:
        """SIGKILL all of it: its sandbox may not be finished."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.popen.pid, signal.SIGKILL)

    def _begin(self, confinement: Confinement, orders: int, owner: str) -> subprocess.Popen[bytes]:
        namespace = self._namespace
        command = confinement.command(self.ground, orders, namespace)
        if namespace is None:
            return _started(command, (orders,), owner, confinement.without)
        try:
            inherited = (orders, *namespace.descriptors)
            return _started(command, inherited, owner, confinement.without)
        finally:
            namespace.started()


def _last_line(pipe: IO[bytes] | None) -> str:
    """What is in a pipe now, the last line of it."""
    if pipe is None or pipe.closed:
        return ""
    os.set_blocking(pipe.fileno(), False)
    said = (pipe.read(SAID_BYTES) or b"").decode("utf-8", "replace").strip()
    return printable(said.splitlines()[-1]) if said else ""


def _started(
    command: list[str], inherited: tuple[int, ...], owner: str, without: Collection[str]
) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        bufsize=0,
        pass_fds=inherited,
        start_new_session="session" not in without,  # no terminal reaches it
        cwd="/",
        env={
            **(os.environ if "environment" in without else {}),
            "PATH": "/usr/local/bin:/usr/bin:/bin",
            "LANG": "C.UTF-8",
            "MALLOC_ARENA_MAX": "2",  # read before Python's first line
            OWNER: owner,
            PLACEHOLDER: "-" * PLACEHOLDER_BYTES,
        },
    )
