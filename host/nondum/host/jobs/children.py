"""Child processes that do what may block, hang or choke on hostile bytes: the daemon's end.

Children are asked as all of the daemon's processes are (`nondum.host.rpc`). They are forked from a
process that has imported what they need and has read nothing (`fork_server.py`). What a child reads
of a drive could take it over, so from then on it works for that drive only and never for anybody
else.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from nondum.host.forking.fork_client import ForkClient, Forked
from nondum.host.jobs.table import ANY, LONGEST, PROGRESS, Progress
from nondum.host.rpc.child_link import ChildLink
from nondum.host.rpc.outcomes import unpacked
from nondum.sdk.errors import InstallFailed, LinkClosed, Problem
from nondum.sdk.wire import Body
from nondum.sdk.wire_fields import read_field
from nondum.wheelhouse.store import disk

KEPT = 4
"""Children that wait for more work of their owners; those that worked last are kept."""

QUIET_S = 30.0
"""Without work for so long, no child is kept."""

AHEAD_S = 1.0
"""Without work for so long, a child is forked ahead for an owner who is not known yet."""

STALL_S = 60.0
"""Read timeout of a job process, unless its job reports progress more often or more rarely."""

START_S = 60.0
"""How long the fork server may take to start, and a child until it begins with its job."""

ASIDE_STALL_S = 600.0
"""Read timeout of a job process that runs only while the processor is idle."""

END_S = 1.0
"""How long a killed child is waited for: one that hangs in its disk cannot even die."""

OnProgress = Callable[[str, int, int], None]

log = logging.getLogger(__name__)


class _Child:
    """A process that does jobs, and the link to it."""

    def __init__(self, process: Forked) -> None:
        """Raises `OSError`; then the process is still the caller's."""
        self.process = process
        self._link = ChildLink(process.conversation, LONGEST)

    async def do(
        self,
        job: str,
        arguments: Mapping[str, Any],
        stall_s: float,
        on_progress: OnProgress | None = None,
    ) -> Body:
        """Have it do a job; its reply. Raises `InstallFailed` (CHILD_…), `ProtocolViolation`."""
        loop = asyncio.get_running_loop()
        # On a small computer that has much to do, Python takes long until it begins.
        try:
            async with asyncio.timeout(max(stall_s, START_S)) as deadline:

                def hear(name: str, body: Body) -> None:
                    if not deadline.expired():
                        deadline.reschedule(loop.time() + stall_s)
                    if name == PROGRESS and on_progress is not None:
                        told: Progress = read_field(Progress, body)
                        on_progress(told.phase, told.done, told.total)

                try:
                    return await self._link.ask(job, dict(arguments), hear)
                except LinkClosed:
                    raise _died(job, await self.process.wait()) from None
        except TimeoutError as error:
            raise _stalled(job, stall_s) from error

    def close(self) -> None:
        """Hear no more of it."""
        self._link.close()
        self.process.close()


class Children:
    """A pool that grows as jobs need it, and shrinks to nothing. `close` it."""

    def __init__(
        self,
        *,
        quiet_s: float = QUIET_S,
        on_crowded: Callable[[], None] = lambda: None,
        stays: Callable[[], bool] | None = None,
    ) -> None:
        """`on_crowded`, and whether the fork server `stays`: see `ForkClient`. A child is forked
        ahead where it always does."""
        self._quiet_s = quiet_s
        self._forks_ahead = stays is None
        self.forks = ForkClient("nondum.host.jobs.child", on_crowded, stays=stays)
        """What they are forked by, and services of the host beside them (`jobs.SERVICES`)."""
        self._kept: dict[str, _Child] = {}
        """Owner → the child that worked for this owner only; the last ones last."""
        self._ahead: _Child | None = None
        """Has read nothing, and works for the next owner."""
        self._busy: set[_Child] = set()
        self._jobs = 0
        """Those that were begun and have not ended; the child of some is still to be forked."""
        self._left_behind: set[_Child] = set()
        """Those that were killed and have not ended yet: a disk may hold one for ever."""
        self._resting: asyncio.Task[None] | None = None

    async def run(
        self,
        job: str,
        arguments: Mapping[str, Any],
        *,
        owner: str = "",
        on_progress: OnProgress | None = None,
        stall_s: float = STALL_S,
    ) -> Any:
        """Have a child do a job, and give what it answers. Cancelling kills the child.

        The child is one that worked for no other `owner`, which is whatever the bytes came from;
        without one, it does this job and ends. Raises the `NondumError` that the job did, or
        `InstallFailed`: CHILD_STALLED when nothing was heard for `stall_s`, which begin once it has
        started, CHILD_LIMIT when it used up its processor time, CHILD_DIED when it ended without an
        answer otherwise.
        """
        with self._counted():
            child = await self._take(owner, job)
            self._busy.add(child)
            try:
                answer = await child.do(job, arguments, stall_s, on_progress)
            except BaseException:
                await self._end(child)
                raise
        await self._keep(child, owner)
        return unpacked(answer)

    async def run_aside(
        self, job: str, arguments: Mapping[str, Any], *, stall_s: float = ASIDE_STALL_S
    ) -> Any:
        """Have a separate child do a job with processor and disk time that is idle otherwise.

        Otherwise as `run`; the child ends with its job.
        """
        with self._counted():
            child = await self._spawn(job)
            self._busy.add(child)
            try:
                _make_idle(child.process.pid)
                return unpacked(await child.do(job, arguments, stall_s))
            finally:
                await self._end(child)

    async def release(self, owner: str) -> None:
        """End the child that is kept for an owner whose work is done."""
        child = self._kept.pop(owner, None)
        if child is not None:
            await self._end(child)

    def pids(self) -> set[int]:
        """Processes of all children."""
        return {child.process.pid for child in self._all()}

    @property
    def server(self) -> int | None:
        """The process that they are forked from, while there is one."""
        return self.forks.pid

    def kept(self) -> dict[str, int]:
        """Owner → the process of the child that waits for more of its work."""
        return {owner: child.process.pid for owner, child in self._kept.items()}

    async def close(self) -> None:
        """Kill all children."""
        if self._resting is not None:
            self._resting.cancel()
            await asyncio.wait([self._resting])
        everyone = {*self._all(), *self._left_behind}
        self._kept.clear()
        self._ahead = None
        await asyncio.gather(*(self._end(child) for child in everyone))
        for child in self._left_behind:
            child.close()
        await self.forks.close()

    async def _take(self, owner: str, job: str) -> _Child:
        """A child that has read no bytes of another owner."""
        if owner in self._kept:
            return self._kept.pop(owner)
        ahead, self._ahead = self._ahead, None
        if ahead is not None and not ahead.process.is_over:
            return ahead
        return await self._spawn(job)

    def _all(self) -> set[_Child]:
        waiting = (self._ahead,) if self._ahead is not None else ()
        return {*self._kept.values(), *self._busy, *waiting}

    async def _spawn(self, job: str) -> _Child:
        """A new child.

        Raises `InstallFailed` (NO_RESOURCES, IO_ERROR, CHILD_DIED, CHILD_STALLED).
        """
        try:
            forked = await self.forks.fork(job, START_S)
            try:
                return _Child(forked)
            except OSError:
                forked.kill()
                forked.close()
                raise
        except TimeoutError as error:
            raise _stalled(job, START_S) from error
        except OSError as error:
            text = "a child process cannot be started"
            raise disk.failed(error, text, Path(sys.executable)) from error
        except EOFError as error:
            message = f"{job}: no child can be forked: {error}"
            raise InstallFailed(Problem("CHILD_DIED", message, fix=_TRY_AGAIN)) from error

    async def _keep(self, child: _Child, owner: str) -> None:
        """Keep a child for its owner, in the place of whichever was kept longest."""
        self._busy.discard(child)
        if not owner:
            await self._end(child)
            return
        former = self._kept.pop(owner, None)
        self._kept[owner] = child
        oldest = next(iter(self._kept)) if len(self._kept) > KEPT else None
        over = former or (self._kept.pop(oldest) if oldest else None)
        if over is not None:
            await self._end(over)

    @contextlib.contextmanager
    def _counted(self) -> Iterator[None]:
        """For the time of a job; after it, those that are kept are seen to."""
        self._jobs += 1
        try:
            yield
        finally:
            self._jobs -= 1
            if self._resting is not None:
                self._resting.cancel()
            self._resting = asyncio.create_task(self._rest())

    async def _rest(self) -> None:
        """Fork the next child; later, end those that are kept."""
        loop = asyncio.get_running_loop()
        until_s = loop.time() + self._quiet_s
        await asyncio.sleep(min(AHEAD_S, self._quiet_s))
        is_missing = self._ahead is None or self._ahead.process.is_over
        # A fork that takes too long ends the server, and with it all that it forked.
        if self._forks_ahead and is_missing and not self._jobs:
            with contextlib.suppress(InstallFailed):  # `run` raises it, if it is so then, too
                self._ahead = await self._spawn(ANY)
        await asyncio.sleep(until_s - loop.time())
        while self._kept:
            await self._end(self._kept.pop(next(iter(self._kept))))

    async def _end(self, child: _Child) -> None:
        self._busy.discard(child)
        self._left_behind.add(child)  # if this coroutine is cancelled here, `close` waits
        process = child.process
        _make_ordinary(process.pid)  # or, while others work, it gets no processor to end with
        process.kill()
        try:
            await asyncio.wait_for(process.over(), END_S)
        except TimeoutError:
            log.warning("child %d hangs in its disk and is left behind", process.pid)
        for other in [each for each in self._left_behind if each.process.is_over]:
            self._left_behind.discard(other)
            other.close()


@contextlib.contextmanager
def watched_without_threads() -> Iterator[None]:
    """Wait for children by descriptors (pidfd_open(2)) meanwhile, as Python 3.12 does by itself.

    3.11 has a thread for each child, which there is no memory for just when it is needed.
    """
    if sys.version_info >= (3, 12):
        yield
        return
    former, watcher = asyncio.get_child_watcher(), asyncio.PidfdChildWatcher()
    watcher.attach_loop(asyncio.get_running_loop())
    asyncio.set_child_watcher(watcher)
    try:
        yield
    finally:
        asyncio.set_child_watcher(former)


def _make_idle(pid: int) -> None:
    """SCHED_IDLE (sched(7)): below any niceness, and its disk accesses are idle, too."""
    with contextlib.suppress(OSError):  # it died, which is told later, or a sandbox forbids it
        os.sched_setscheduler(pid, os.SCHED_IDLE, os.sched_param(0))


def _make_ordinary(pid: int) -> None:
    with contextlib.suppress(OSError):  # it died, or RLIMIT_NICE leaves no way back
        os.sched_setscheduler(pid, os.SCHED_OTHER, os.sched_param(0))


def _stalled(job: str, stall_s: float) -> InstallFailed:
    message = f"{job}: nothing was heard for {stall_s:g} s"
    return InstallFailed(Problem("CHILD_STALLED", message, fix=_TRY_AGAIN))


def _died(job: str, code: int) -> InstallFailed:
    """What is told of a child that ended before it answered."""
    if code == -signal.SIGXCPU:
        message = f"{job}: took more processor time than it may"
        return InstallFailed(Problem("CHILD_LIMIT", message, fix=_TRY_AGAIN))
    names = {-number.value: number.name for number in signal.Signals}
    message = f"{job}: the child ended with {names.get(code, code)} before it answered"
    return InstallFailed(Problem("CHILD_DIED", message, fix=_TRY_AGAIN))


_TRY_AGAIN = "pull the drive and plug it in again; if that does not help, build it again"
