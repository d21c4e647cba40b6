"""Child processes that do what may block, hang or choke on hostile bytes: the daemon's end.

Requests go down a child's stdin and answers come up its stdout, one JSON object a line. Spare
children are kept warm, since starting an interpreter costs more than most jobs.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import Callable, Mapping
from typing import Any

from nondum.sdk import errors
from nondum.sdk.errors import InstallFailed, NondumError, Problem

LINE_LIMIT = 16 * 1024 * 1024
"""Bytes of one answer: it may hold the descriptions of many components."""

SPARES = 2
"""Idle children that are kept while there is work; the one used last is used first."""

QUIET_S = 30.0
"""Without work for so long, one spare is enough."""

ASIDE_STALL_S = 600.0
"""Silence that is borne from a child that works only while nobody else does."""

END_S = 1.0
"""How long a killed child is waited for: one that hangs in its disk cannot even die."""

OnProgress = Callable[[str, int, int], None]

log = logging.getLogger(__name__)


class Children:
    """A pool that grows as jobs need it and shrinks to its spares. `close` it."""

    def __init__(self, *, quiet_s: float = QUIET_S) -> None:
        self._quiet_s = quiet_s
        self._shrinking: asyncio.Task[None] | None = None
        self._idle: list[Process] = []
        self._busy: set[Process] = set()
        self._warming: asyncio.Task[None] | None = None

    async def run(
        self,
        job: str,
        arguments: Mapping[str, Any],
        *,
        on_progress: OnProgress | None = None,
        stall_s: float = 60.0,
    ) -> Any:
        """Have a child do a job, and give what it answers. Cancelling kills the child.

        Raises the `NondumError` that the job did, or `InstallFailed`: CHILD_STALLED when nothing
        was heard for `stall_s`, CHILD_DIED when it ended without an answer.
        """
        child = self._idle.pop() if self._idle else await _spawn()
        self._busy.add(child)
        try:
            async with asyncio.timeout(None) as deadline:
                answer = await _converse(child, job, arguments, on_progress, deadline, stall_s)
        except TimeoutError as error:
            await self._end(child)
            self.warm()
            raise _stalled(job, stall_s) from error
        except BaseException:
            await self._end(child)
            self.warm()
            raise
        self._busy.discard(child)
        await self._keep(child)
        return _result(answer)

    async def run_aside(
        self, job: str, arguments: Mapping[str, Any], *, stall_s: float = ASIDE_STALL_S
    ) -> Any:
        """Have a child of its own do a job with what processor and disk time nobody else wants.

        Otherwise as `run`; the child ends with its job.
        """
        child = await _spawn()
        self._busy.add(child)
        try:
            _make_idle(child.pid)
            async with asyncio.timeout(None) as deadline:
                answer = await _converse(child, job, arguments, None, deadline, stall_s)
        except TimeoutError as error:
            raise _stalled(job, stall_s) from error
        finally:
            await self._end(child)
        return _result(answer)

    def warm(self) -> None:
        """Have a spare, soon, if there is none."""
        if not self._idle and (self._warming is None or self._warming.done()):
            self._warming = asyncio.create_task(self._warm())

    def pids(self) -> set[int]:
        """Processes of all children."""
        return {child.pid for child in (*self._idle, *self._busy)}

    async def close(self) -> None:
        """Kill all children."""
        if self._warming is not None:
            await asyncio.wait([self._warming])
        if self._shrinking is not None:
            self._shrinking.cancel()
            await asyncio.wait([self._shrinking])
        await asyncio.gather(*(self._end(child) for child in (*self._idle, *self._busy)))
        self._idle.clear()

    async def _warm(self) -> None:
        self._idle.append(await _spawn())

    async def _keep(self, child: Process) -> None:
        if len(self._idle) >= SPARES:
            await self._end(child)
            return
        self._idle.append(child)
        if self._shrinking is not None:
            self._shrinking.cancel()
        self._shrinking = asyncio.create_task(self._shrink())

    async def _shrink(self) -> None:
        await asyncio.sleep(self._quiet_s)
        while len(self._idle) > 1:
            await self._end(self._idle.pop(0))

    async def _end(self, child: Process) -> None:
        self._busy.discard(child)
        with contextlib.suppress(ProcessLookupError):
            child.kill()
        try:
            await asyncio.wait_for(child.wait(), END_S)
        except TimeoutError:
            log.warning("child %d hangs in its disk and is left behind", child.pid)


async def _spawn() -> Process:
    return await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "nondum.host.lifecycle.child", str(os.getpid())),
        stdin=PIPE,
        stdout=PIPE,
        limit=LINE_LIMIT,
        start_new_session=True,
    )


async def _converse(
    child: Process,
    job: str,
    arguments: Mapping[str, Any],
    on_progress: OnProgress | None,
    deadline: asyncio.Timeout,
    stall_s: float,
) -> dict[str, Any]:
    assert child.stdin is not None  # both are pipes
    assert child.stdout is not None
    loop = asyncio.get_running_loop()
    line = json.dumps({"job": job, "arguments": dict(arguments)}) + "\n"
    with contextlib.suppress(ConnectionError):  # it died: the answer below is missing
        child.stdin.write(line.encode())
        await child.stdin.drain()
    while True:
        deadline.reschedule(loop.time() + stall_s)
        heard = await child.stdout.readline()
        if not heard:
            code = await child.wait()
            message = f"{job}: the child ended with {code} before it answered"
            raise InstallFailed(Problem("CHILD_DIED", message))
        answer: dict[str, Any] = json.loads(heard)
        if "progress" not in answer:
            return answer
        if on_progress is not None:
            on_progress(*answer["progress"])


def _make_idle(pid: int) -> None:
    """SCHED_IDLE (sched(7)): below any niceness, and its disk accesses are idle, too."""
    with contextlib.suppress(OSError):  # it died, which is told later, or a sandbox forbids it
        os.sched_setscheduler(pid, os.SCHED_IDLE, os.sched_param(0))


def _result(answer: Mapping[str, Any]) -> Any:
    """What a job gave. Raises what it raised."""
    if "problems" in answer:
        kind = getattr(errors, answer["error"], InstallFailed)
        error: NondumError = kind(*(Problem(**problem) for problem in answer["problems"]))
        raise error
    return answer["result"]


def _stalled(job: str, stall_s: float) -> InstallFailed:
    message = f"{job}: nothing was heard for {stall_s:g} s"
    return InstallFailed(Problem("CHILD_STALLED", message))
