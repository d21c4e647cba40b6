"""The behaviours that a worker runs: asked for, halted, and seen to their end."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

from nondum.host.workers import problems
from nondum.host.workers.call import Call
from nondum.host.workers.news import parse_answer
from nondum.planning.execute.running import RunState
from nondum.sdk.errors import LinkClosed, NondumError, Problem, WorkerFailed
from nondum.sdk.link import Pending
from nondum.transport import WorkerLink


class RunningCalls:
    """Of one worker."""

    def __init__(
        self,
        component: str,
        link: WorkerLink,
        halt_s: float,
        gone: asyncio.Future[Problem],
        on_unhalted: Callable[[Problem], None],
    ) -> None:
        """`gone` says why the worker ended, `on_unhalted` is told of a behaviour that goes on
        `halt_s` after it was to end."""
        self._component, self._link, self._halt_s = component, link, halt_s
        self._gone, self._on_unhalted = gone, on_unhalted
        self._loop = asyncio.get_running_loop()
        self._calls: dict[int, Call] = {}

    def __len__(self) -> int:
        """How many run."""
        return len(self._calls)

    def of(self, id: int | None) -> Call | None:
        """The call that an event of the worker is about, if it still runs."""
        return self._calls.get(id) if id is not None else None

    async def behave(self, call: Call, values: Sequence[Any]) -> None:
        """Run a behaviour to its end, which the call is told."""
        body = {"behaviour": call.behaviour, "arguments": call.arguments, "values": values}
        try:
            pending = self._link.begin("behave", body)
        except NondumError as error:
            call.end(RunState.FAILED, problems.words(error))
            return
        self._calls[pending.id] = call
        call.when_halted(lambda: self._halt(pending, call.behaviour))
        try:
            call.end(*await self._outcome(pending, call))
        finally:
            del self._calls[pending.id]

    async def _outcome(self, pending: Pending, call: Call) -> tuple[RunState, str]:
        try:
            answer = parse_answer(await pending)
        except LinkClosed:
            problem = await asyncio.shield(self._gone)
            is_expected = call.is_halting or problem.code == problems.REMOVED
            return RunState.HALTED if is_expected else RunState.FAILED, str(problem)
        except WorkerFailed as error:
            is_halted = error.code == "HALTED"
            return RunState.HALTED if is_halted else RunState.FAILED, problems.words(error)
        return RunState.SUCCEEDED, answer

    def _halt(self, pending: Pending, behaviour: str) -> None:
        self._link.cancel(pending.id)
        self._loop.call_later(self._halt_s, self._insist, pending, behaviour)

    def _insist(self, pending: Pending, behaviour: str) -> None:
        # the answer, not the call's state, which is a turn of the loop behind: a loop that was held
        # up reads the answer in the turn in which this timer is due
        if not pending.outcome.done():
            self._on_unhalted(problems.unhalted(self._component, behaviour, self._halt_s))
