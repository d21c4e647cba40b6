"""Starts a worker: its process is launched, it says what it is, and its plugin starts."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable, Mapping
from typing import Any

from nondum.host.core.events.event import Emit
from nondum.host.core.shielded import until_done
from nondum.host.workers import problems
from nondum.host.workers.launcher import Launcher
from nondum.host.workers.leftovers import clear_away, ends_of_all
from nondum.host.workers.process import WorkerProcess
from nondum.host.workers.spec import Timing, WorkerSpec
from nondum.host.workers.worker import OnCrowded, Worker
from nondum.sdk.errors import LinkClosed, Problem, ProtocolViolation, WorkerFailed
from nondum.transport import link_sockets

CROWDED_S, CROWDED_TRIES = 0.1, 50
"""Between attempts to start a worker while no descriptor can be handed to it, and how many."""


async def start_worker(
    spec: WorkerSpec,
    welcome: Mapping[str, Any],
    *,
    launcher: Launcher,
    timing: Timing,
    emit: Emit,
    on_crowded: OnCrowded = lambda count: None,
    on_launched: Callable[[Worker], None] = lambda worker: None,
) -> Worker:
    """Launch a worker and see it through its start.

    Raises `WorkerFailed` with what went wrong; then, or when cancelled, however often, nothing of
    it is left.
    """
    worker = await _launched(spec, launcher, timing, emit, on_crowded)
    on_launched(worker)
    startup_s = spec.asked.startup_s or timing.startup_s
    try:
        async with asyncio.timeout(startup_s):
            await worker.introduce(welcome)
    except BaseException as error:
        worker.end(Problem("WORKER_START_FAILED", "it did not start", where=spec.component))
        problem = await worker.ended()
        match error:
            case LinkClosed():
                raise WorkerFailed(problems.before_start(problem)) from None
            case TimeoutError():
                raise WorkerFailed(problems.overdue(spec.component, startup_s)) from None
            case ProtocolViolation():
                raise WorkerFailed(problems.foul(spec.component, error)) from error
            case WorkerFailed():
                raise WorkerFailed(*problems.located(spec.component, error)) from error
        raise
    return worker


async def _launched(
    spec: WorkerSpec, launcher: Launcher, timing: Timing, emit: Emit, on_crowded: OnCrowded
) -> Worker:
    """A launched worker; what stands in the way only for now is waited for.

    Raises `WorkerFailed` (LAUNCH_FAILED, LAUNCH_CROWDED).
    """
    try:
        with contextlib.ExitStack() as failed:
            ours, theirs = link_sockets()
            failed.callback(ours.close)
            with theirs:
                process = await _process(spec, launcher, theirs, on_crowded)
            try:
                worker = Worker(spec, process, ours, timing, emit, on_crowded)
            except BaseException:
                await until_done(asyncio.create_task(_end_unread(process, spec)))
                raise
            failed.pop_all()
            return worker
    except OSError as error:
        problem = Problem("LAUNCH_FAILED", str(error), where=spec.component)
        raise WorkerFailed(problem) from error


async def _end_unread(process: WorkerProcess, spec: WorkerSpec) -> None:
    """End one that no `Worker` could be made of, and whatever it has started."""
    await process.end(0.0)
    for pipe in process.outputs:
        pipe.close()
    with contextlib.suppress(OSError):  # what is left is the next sweep's
        await asyncio.to_thread(clear_away, *ends_of_all(process.cgroup, spec.scratch))


async def _process(
    spec: WorkerSpec, launcher: Launcher, sock: socket.socket, on_crowded: OnCrowded
) -> WorkerProcess:
    for _ in range(CROWDED_TRIES):
        try:
            return await launcher.launch(spec, sock)
        except WorkerFailed as error:
            if error.code != "LAUNCH_CROWDED":
                raise
        on_crowded(1)
        await asyncio.sleep(CROWDED_S)
    return await launcher.launch(spec, sock)
