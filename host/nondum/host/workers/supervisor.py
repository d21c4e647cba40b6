"""Keeps one component's worker alive: starts, restarts with growing patience, gives up, stops."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping
from typing import Any, Protocol

from nondum.host.core.events import workers as worker_events
from nondum.host.core.events.event import Event
from nondum.host.core.events.releases import TrialFailed
from nondum.host.core.events.workers import WorkerExited, WorkerReady, WorkerStable
from nondum.host.core.shielded import until_done
from nondum.host.workers import problems, supervision
from nondum.host.workers.in_flight import Search
from nondum.host.workers.launcher import Launcher
from nondum.host.workers.role import EMITTED, Role
from nondum.host.workers.spec import Timing, WorkerSpec
from nondum.host.workers.supervision import Supervision
from nondum.host.workers.worker import Worker
from nondum.host.workers.worker_start import start_worker
from nondum.sdk.errors import Problem, WorkerFailed

log = logging.getLogger(__name__)


class Household(Protocol):
    """What a supervisor needs of those around it."""

    launcher: Launcher
    timing: Timing

    def welcome(self, spec: WorkerSpec) -> Mapping[str, Any]:
        """What a new worker of a component is told of its place."""
        ...

    def emit(self, event: Event) -> None:
        """Hand on what has happened."""
        ...

    @property
    def search(self) -> Search:
        """Finds the worker that keeps descriptors of others from being sent."""
        ...

    def on_ready(self, worker: Worker) -> None:
        """A worker may be asked for things from now on."""
        ...

    def on_gone(self, worker: Worker) -> None:
        """A worker that was ready is going or gone; may be told twice."""
        ...


class Supervisor:
    """One component's worker and the ones that come after it."""

    def __init__(self, spec: WorkerSpec, household: Household, role: Role = Role.ACTIVE) -> None:
        self.spec = spec
        self.role = role
        """How much it counts; what happens to it is told accordingly."""
        self._worker: Worker | None = None
        self._household = household
        self._supervision = Supervision(backoff_s=household.timing.backoff_s)
        self._task: asyncio.Task[None] | None = None
        """Starts the first worker, then keeps one alive."""
        self.is_stopping = False
        """Whether it has been told to end, for good."""

    @property
    def worker(self) -> Worker | None:
        """The one that runs and may be asked for things, if any."""
        return None if self.is_stopping else self._worker

    @property
    def is_alive(self) -> bool:
        """Whether there is a worker, or one will be started without being asked for."""
        return self._task is not None and not self._task.done()

    async def start(self) -> None:
        """Start the first worker and keep one alive from then on.

        Raises `WorkerFailed`; then there is none, and none will be. Cancelled, it leaves none.
        """
        self.is_stopping = False
        self._supervision = Supervision(backoff_s=self._household.timing.backoff_s)
        self._task = asyncio.create_task(self._start_worker())
        try:
            await self._task
        except asyncio.CancelledError:
            if self.is_stopping:
                raise WorkerFailed(problems.removed(self.spec.component)) from None
            raise
        self._task = asyncio.create_task(self._keep_alive())

    def come_into_force(self) -> None:
        """From now on it stands for its component."""
        self.role = Role.ACTIVE
        if self._worker is not None:
            self._household.on_ready(self._worker)
            self._worker.reports.tell_conditions()

    def withdraw(self) -> None:
        """Take it out of use; `stop` it next."""
        self._on_gone()
        self.role = Role.LEAVING

    async def stop(self, grace_s: float) -> None:
        """End the worker, if there is one, and start no more. Stopping twice is allowed.

        Cancelled, it is over when nothing of the worker is left, too.
        """
        self.is_stopping = True
        try:
            if self._worker is not None:
                self._on_gone()
                await self._worker.stop(grace_s, problems.removed(self.spec.component))
            elif self._task is not None:
                self._task.cancel()
        finally:
            if self._task is not None:
                await until_done(self._task)

    async def ended(self) -> None:
        """Wait until there is no worker and none will be started."""
        if self._task is not None:
            await asyncio.wait([self._task])

    async def _keep_alive(self) -> None:
        while True:
            problem = await self._work()
            if self.is_stopping:
                return
            if self.role is Role.BESIDE:
                self._emit(TrialFailed(self.spec.payload, self.spec.component, (problem,)))
                return
            component, payload = self.spec.component, self.spec.payload
            self._emit(WorkerExited(component, str(problem), payload, problem))
            if not await self._restart(problem):
                return

    async def _work(self) -> Problem:
        """Wait for the end of the present worker; say why it ended."""
        worker = self._worker
        assert worker is not None, "only called after a start"
        if self._supervision.crashes:
            problem = await self._outlived(worker)
        else:
            problem = await asyncio.shield(worker.gone)
        self._on_gone()
        self._worker = None
        return problem

    async def _outlived(self, worker: Worker) -> Problem:
        """The same for one that others have crashed before: after a while that is past."""
        try:
            async with asyncio.timeout(supervision.WINDOW_S):
                return await asyncio.shield(worker.gone)
        except TimeoutError:
            self._emit(WorkerStable(self.spec.component, self.spec.payload))
            return await asyncio.shield(worker.gone)

    async def _restart(self, problem: Problem) -> bool:
        """Start another worker, trying as often as supervision allows; say whether one runs."""
        while True:
            now_s = asyncio.get_running_loop().time()
            self._supervision = self._supervision.crashed(now_s)
            if self._supervision.is_exhausted:
                self._give_up(problem)
                return False
            await asyncio.sleep(self._supervision.delay_s)
            try:
                await self._start_worker()
                return True
            except WorkerFailed as error:
                log.warning("%s could not be restarted: %s", self.spec.component, error)
                problem = error.problems[0]

    def _give_up(self, last: Problem) -> None:
        problem = problems.crash_loop(
            self.spec.component, supervision.RESTARTS, supervision.WINDOW_S, last
        )
        self._emit(
            worker_events.WorkerFailed(self.spec.component, (problem, last), self.spec.payload)
        )

    async def _start_worker(self) -> None:
        household = self._household
        is_active = self.role is Role.ACTIVE
        welcome = household.welcome(self.spec)
        self._worker = await start_worker(
            self.spec,
            welcome if is_active else {**welcome, "devices": {}},
            launcher=household.launcher,
            timing=household.timing,
            emit=self._emit,
            on_crowded=household.search.begin,
            on_launched=household.search.watch,
        )
        if self.role is Role.ACTIVE:
            household.on_ready(self._worker)
        self._emit(WorkerReady(self.spec.component, self.spec.index, self.spec.payload))
        self._worker.reports.tell_conditions()

    def _emit(self, event: Event) -> None:
        """Tell what has happened, as far as it is anybody's business."""
        if isinstance(event, EMITTED[self.role]):
            self._household.emit(event)

    def _on_gone(self) -> None:
        if self._worker is not None and self.role is Role.ACTIVE:
            self._household.on_gone(self._worker)
