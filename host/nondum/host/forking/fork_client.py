"""The daemon's end of its fork server: starts it, and talks with the processes that it forks."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import os
import select
import signal
import socket
import sys
from asyncio.subprocess import DEVNULL, Process
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType

from nondum.host.forking import fork_server
from nondum.sdk.packets import CROWDED_S, CROWDED_TRIES

END_S = 1.0
"""How long a killed server is waited for."""
REST_S = 10.0
"""How long a server that need not stay is unused before it ends."""

log = logging.getLogger(__name__)


class Forked:
    """A process of the fork server. `close` it once it has ended, or is to be left behind."""

    def __init__(self, pid: int, descriptor: int, status: int, conversation: socket.socket) -> None:
        """`descriptor` is its pidfd; its return code can be read from `status`. It closes both.

        Raises `OSError` when they cannot be watched: then they are still the caller's.
        """
        self.pid = pid
        self.conversation = conversation
        """The other end of its descriptor 0, for packets; a link over it is closed before this."""
        self.returncode: int | None = None
        """None until it has ended; negative for a signal."""
        self._descriptor, self._status = descriptor, status
        self._over, self._ended = asyncio.Event(), asyncio.Event()
        loop = asyncio.get_running_loop()
        loop.add_reader(descriptor, self._see_over)
        try:
            loop.add_reader(status, self._see_end)
        except OSError:
            loop.remove_reader(descriptor)
            raise

    def kill(self) -> None:
        """SIGKILL it, if it runs."""
        if self._status >= 0:
            _kill(self._descriptor)

    def kill_all(self) -> None:
        """SIGKILL it, and what it has started, if it leads a session."""
        if self._status >= 0:
            self.kill()
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, signal.SIGKILL)

    @property
    def is_over(self) -> bool:
        """Whether it runs no more, also where the loop has not come to see it yet."""
        return self._over.is_set() or (self._status >= 0 and _is_readable(self._descriptor))

    async def over(self) -> None:
        """Wait until it runs no more. The server may be too busy to tell the return code as yet."""
        await self._over.wait()

    async def wait(self) -> int:
        """Its return code, once the server has told it."""
        await self._ended.wait()
        assert self.returncode is not None
        return self.returncode

    def close(self) -> None:
        """Hear no more of it, whether it has ended or not."""
        self.conversation.close()
        self._forget()

    def _see_over(self) -> None:
        asyncio.get_running_loop().remove_reader(self._descriptor)
        self._over.set()

    def _see_end(self) -> None:
        said = os.read(self._status, fork_server.ANSWER_BYTES)
        self.returncode = int(said or -signal.SIGKILL)  # the server's end is that of all it forked
        self._forget()
        self._over.set()
        self._ended.set()

    def _forget(self) -> None:
        if self._status >= 0:
            loop = asyncio.get_running_loop()
            loop.remove_reader(self._descriptor)
            loop.remove_reader(self._status)
            os.close(self._status)
            os.close(self._descriptor)
            self._status = -1


class ForkClient:
    """Starts the fork server when it is first needed, and again when it has ended. `close` it."""

    def __init__(
        self,
        module: str,
        on_crowded: Callable[[], None] = lambda: None,
        *,
        environment: Mapping[str, str] = MappingProxyType({}),
        stays: Callable[[], bool] | None = None,
    ) -> None:
        """`module` is run as a program with this process's id and the descriptor of its end of the
        channel (`fork_server.serve`), with `environment` added to that of this
        process. `on_crowded` is called when descriptors cannot be sent yet since too many of this
        user's are under way (ETOOMANYREFS, unix(7)): that is tried again. A server for which
        `stays` is false ends some time after all that it forked; None: it is always kept."""
        self._module, self._on_crowded, self._stays = module, on_crowded, stays
        self._environment = environment
        self._server: Process | None = None
        self._channel: socket.socket | None = None
        self._expected: list[str] = []
        self._running: list[Forked] = []
        """Those that may run."""
        self._turn = asyncio.Lock()
        self._used_s = 0.0
        self._resting: asyncio.Task[None] | None = None

    @property
    def stays(self) -> bool:
        """Whether the server is kept now, whatever runs."""
        return self._stays is None or self._stays()

    @property
    def pid(self) -> int | None:
        """The server's process, while there is one."""
        return self._server.pid if self._server is not None else None

    async def fork(self, message: str, patience_s: float) -> Forked:
        """A new process.

        Raises `OSError` when none can be started, `EOFError` when the server ends as soon as it is
        started, `TimeoutError` when it does not answer for so long: then all that it forked ends.
        """
        forking = asyncio.ensure_future(self._in_turn(message, patience_s))
        try:
            return await asyncio.shield(forking)
        except asyncio.CancelledError:  # the answer is read, or the next one would be taken for it
            with contextlib.suppress(OSError, EOFError, TimeoutError):
                unwanted = await forking
                unwanted.kill()
                unwanted.close()
            raise

    async def expect(self, message: str) -> None:
        """Have the server, and each one that follows it, import what such a process needs, so that
        the first one is forked at once. A failure is logged only: `fork` raises it."""
        async with self._turn:
            if message in self._expected:
                return
            self._expected.append(message)
            try:
                if self._channel is None:
                    self._channel = await self._start()
                else:
                    fork_server.ask(self._channel, message.encode(), ())
            except OSError as error:
                log.warning("the fork server cannot prepare for %s: %s", message, error)

    async def close(self) -> None:
        """End the server, and all that it forked."""
        async with self._turn:  # `_rest` may be ending it just now
            await self._end()
        if self._resting is not None:
            self._resting.cancel()
            await asyncio.wait([self._resting])

    async def _rest(self, stays: Callable[[], bool]) -> None:
        """End the server once it is not used any more."""
        loop = asyncio.get_running_loop()
        while self._server is not None:
            await asyncio.sleep(REST_S)
            async with self._turn:
                is_used = loop.time() - self._used_s < REST_S
                if not is_used and not stays() and all(one.is_over for one in self._running):
                    await self._end()

    async def _in_turn(self, message: str, patience_s: float) -> Forked:
        async with self._turn:
            try:
                async with asyncio.timeout(patience_s):
                    return await self._from_a_server(message)
            except BaseException as error:
                if not isinstance(error, OSError) or isinstance(error, TimeoutError):
                    await self._end()
                raise

    async def _from_a_server(self, message: str) -> Forked:
        if self._channel is not None:
            with contextlib.suppress(EOFError):
                return await self._fork(self._channel, message)
            log.warning("the fork server has ended; another one is started")
            await self._end()
        self._channel = await self._start()
        return await self._fork(self._channel, message)

    async def _start(self) -> socket.socket:
        channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        channel.settimeout(0)
        with theirs:
            try:
                self._server = await asyncio.create_subprocess_exec(
                    *(sys.executable, "-P", "-m", self._module),
                    *(str(os.getpid()), str(theirs.fileno())),
                    stdin=DEVNULL,
                    stdout=DEVNULL,
                    pass_fds=(theirs.fileno(),),
                    env={**os.environ, **self._environment},
                    start_new_session=True,
                    cwd="/",
                )
                for message in self._expected:
                    fork_server.ask(channel, message.encode(), ())
            except BaseException:
                channel.close()
                raise
        self._used_s = asyncio.get_running_loop().time()
        if self._stays is not None and (self._resting is None or self._resting.done()):
            self._resting = asyncio.create_task(self._rest(self._stays))
        return channel

    async def _fork(self, channel: socket.socket, message: str) -> Forked:
        for _ in range(CROWDED_TRIES):
            try:
                return await self._forked(channel, message)
            except OSError as error:
                if error.errno != errno.ETOOMANYREFS:
                    raise
            self._on_crowded()
            await asyncio.sleep(CROWDED_S)
        return await self._forked(channel, message)

    async def _forked(self, channel: socket.socket, message: str) -> Forked:
        # Watched before the request is sent: if watching failed later, the answer would stay unread
        # and be taken for that of the next request.
        with _readable(channel) as is_answered, contextlib.ExitStack() as failed:
            ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            failed.callback(theirs.close)
            failed.callback(ours.close)
            status, of_server = os.pipe()
            failed.callback(os.close, status)
            try:
                with theirs, _closed(of_server):
                    given = (theirs.fileno(), of_server)
                    fork_server.ask(channel, message.encode(), given)
                await is_answered.wait()
                pid, descriptor = fork_server.answer(channel)
            except ConnectionError as error:  # it ended before it had read the request
                raise EOFError("the fork server has ended") from error
            failed.callback(os.close, descriptor)
            failed.callback(_kill, descriptor)
            forked = Forked(pid, descriptor, status, ours)
            failed.pop_all()
            self._running = [*(other for other in self._running if not other.is_over), forked]
            self._used_s = asyncio.get_running_loop().time()
            return forked

    async def _end(self) -> None:
        if self._channel is not None:
            self._channel.close()
            self._channel = None
        server, self._server = self._server, None
        if server is None:
            return
        if server.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(server.pid, signal.SIGKILL)  # its own `kill` may take its end from asyncio
        try:
            await asyncio.wait_for(server.wait(), END_S)
        except TimeoutError:
            log.warning("the fork server %d cannot be ended, and is left behind", server.pid)


@contextlib.contextmanager
def _readable(channel: socket.socket) -> Iterator[asyncio.Event]:
    """Set when there is something to be read."""
    loop, is_there = asyncio.get_running_loop(), asyncio.Event()
    loop.add_reader(channel, is_there.set)
    try:
        yield is_there
    finally:
        loop.remove_reader(channel)


@contextlib.contextmanager
def _closed(descriptor: int) -> Iterator[None]:
    try:
        yield
    finally:
        os.close(descriptor)


def _is_readable(pidfd: int) -> bool:
    """Whether its process has ended (pidfd_open(2))."""
    poll = select.poll()
    poll.register(pidfd, select.POLLIN)
    return bool(poll.poll(0))


def _kill(pidfd: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        signal.pidfd_send_signal(pidfd, signal.SIGKILL)
