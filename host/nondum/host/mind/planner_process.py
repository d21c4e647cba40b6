"""One planner in a separate process: killed when it overruns, is not wanted, or has had no task for
a while."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine, Mapping
from pathlib import Path
from typing import Any, TypeVar

from nondum.host.forking.fork_client import ForkClient, Forked
from nondum.host.mind import planner_wire as wire
from nondum.host.mind.planner_child import expected, start_of
from nondum.host.mind.planner_folder import PlannerFolder
from nondum.host.rpc.child_link import ChildLink
from nondum.host.rpc.outcomes import unpacked
from nondum.sdk.errors import LinkClosed, NondumError, PlannerFailed, Problem
from nondum.sdk.planner import Answer, GaveUp, PlanText

START_S = 60.0
"""How long a planner may take to load: on a small computer that is just starting, a while."""
GRACE_S = 0.5
"""How much longer than its deadline a planner may take before it is killed."""
QUIET_S = 30.0
"""Without a task for so long, there is no process."""
AT_ONCE = 2_000
"""Ground actions that are written for the wire in a time that the loop can spare."""
_LANGUAGES = ("ground", "pddl")

log = logging.getLogger(__name__)

_T = TypeVar("_T")


def planner_forks(
    environment: Mapping[str, str] | None = None, *, stays: Callable[[], bool] | None = None
) -> ForkClient:
    """The fork server of planners, with `environment` added to that of this process; whether it
    `stays` when no planner has a task: see `ForkClient`. Close it."""
    return ForkClient(
        "nondum.host.mind.planner_child",
        environment={"PYTHONHASHSEED": "0", **(environment or {})},
        stays=stays,
    )


class PlannerProcess:
    """Serves one task at a time. Close it when done."""

    def __init__(
        self,
        name: str,
        reference: str,
        forks: ForkClient,
        *,
        memory_mb: int,
        temporary: Path | None = None,
    ) -> None:
        """`reference` (`module:class`) is what entry point `name` in group `nondum.planners` names.
        The child's temporary files are in a folder below `temporary`, or where this machine has
        such."""
        self.name = name
        self._reference, self._memory_mb = reference, memory_mb
        self._forks = forks
        self._folder = PlannerFolder(name, temporary)
        self._process: Forked | None = None
        self._link: ChildLink | None = None
        self._resting: asyncio.TimerHandle | None = None
        self._ending: asyncio.Future[None] | None = None
        """Kept, since a loop keeps no tasks."""
        self._going: set[asyncio.Future[Any]] = set()
        """Tasks that outlive a cancelled caller; `close` waits for them."""
        self._language = ""
        self._handles: frozenset[str] = frozenset()
        self._lock = asyncio.Lock()

    @property
    def pid(self) -> int | None:
        """Process id of the child, while there is one."""
        return self._process.pid if self._process else None

    async def warm(self) -> None:
        """Have the planner imported, so that the first task need not wait for that."""
        await self._forks.expect(expected(self._reference))

    async def plan(self, request: wire.Request, deadline_s: float) -> Answer | PlanText:
        """Ask for a plan, if the planner is one for such tasks. Being cancelled kills the child.

        Raises `PlannerFailed` (PLANNER_START, PLANNER_DIED, PLANNER_ANSWER, PLANNER_RAISED).
        """
        async with self._lock:
            self._wake()
            try:
                link = await self._running()
                if reason := self._refusal(request):
                    return GaveUp(reason)
                async with asyncio.timeout(deadline_s + GRACE_S):
                    return await self._asked(link, request, deadline_s)
            except TimeoutError:
                await self._kill()
                return GaveUp(f"it overran its deadline of {deadline_s:g} s and was killed")
            except (PlannerFailed, asyncio.CancelledError) as error:
                if not isinstance(error, PlannerFailed) or error.code != "PLANNER_RAISED":
                    await self._kill()
                raise
            finally:
                self._resting = asyncio.get_running_loop().call_later(QUIET_S, self._rest)

    async def close(self) -> None:
        """End the child, and with it a search that is under way."""
        if self._process is not None:
            self._process.kill_all()
        async with self._lock:
            self._wake()
            await self._kill()
            # Behind whatever outlives a cancelled caller: a start may just have made the folder.
            await self._to_its_end(asyncio.to_thread(self._folder.remove))
        if self._ending is not None:
            await self._ending

    def _wake(self) -> None:
        if self._resting is not None:
            self._resting.cancel()
            self._resting = None

    def _rest(self) -> None:
        self._ending = asyncio.ensure_future(self._end_at_rest())

    async def _end_at_rest(self) -> None:
        async with self._lock:
            now_s = asyncio.get_running_loop().time()
            if self._resting is not None and self._resting.when() <= now_s:
                await self._kill()

    def _refusal(self, request: wire.Request) -> str:
        """Why the planner is not one for a task; empty if it is."""
        unhandled = request.task.features - self._handles
        if unhandled:
            return f"it does not handle {' and '.join(sorted(unhandled))}"
        if not request.speaks(self._language):
            return f"the task is not told in {self._language}"
        return ""

    async def _asked(
        self, link: ChildLink, request: wire.Request, deadline_s: float
    ) -> Answer | PlanText:
        until_s = time.monotonic() + deadline_s
        if len(request.task.actions) > AT_ONCE:
            body = await asyncio.to_thread(request.body, self._language)
        else:
            body = request.body(self._language)
        return wire.answer_from_wire(await self._ask(link, wire.PLAN, [until_s, body]))

    async def _running(self) -> ChildLink:
        """The link to the child, which is started if there is none."""
        is_there = self._process is not None and not self._process.is_over
        if self._link is not None and is_there and self._language:
            return self._link
        await self._kill()
        folder = await self._to_its_end(asyncio.to_thread(self._folder.make))
        self._link = await self._started(folder)
        try:
            async with asyncio.timeout(START_S):
                told = await self._ask(self._link, wire.DESCRIBE, None)
        except (TimeoutError, PlannerFailed) as error:
            await self._kill()
            raise self._failure("PLANNER_START", "it does not start") from error
        match told:
            case [str(language), [*handles]] if language in _LANGUAGES:
                self._language, self._handles = language, frozenset(map(str, handles))
            case _:
                await self._kill()
                raise self._failure("PLANNER_START", f"it speaks no language of this host: {told}")
        return self._link

    async def _started(self, folder: str) -> ChildLink:
        """Start the child. Where this host has no process or descriptor left, others may plan."""
        start = start_of(self._reference, self._memory_mb, folder)
        try:
            self._process = await self._forks.fork(start, START_S)
            return ChildLink(self._process.conversation, wire.MAX_BYTES)
        except (OSError, EOFError) as error:
            log.warning("planner %s cannot be started: %s", self.name, error)
            await self._kill()
            await self._to_its_end(asyncio.to_thread(self._folder.remove))
            raise self._failure("PLANNER_START", "it does not start") from error

    async def _ask(self, link: ChildLink, verb: str, value: object) -> object:
        try:
            return unpacked(await link.ask(verb, value))
        except LinkClosed as error:
            raise self._failure("PLANNER_DIED", "it ended without an answer") from error
        except PlannerFailed:
            raise
        except NondumError as error:  # it broke the protocol
            raise self._failure("PLANNER_ANSWER", error.problems[0].message) from error

    async def _kill(self) -> None:
        link, self._link = self._link, None
        if link is not None:
            link.close()
        process, self._process, self._language = self._process, None, ""
        if process is None:
            return
        process.kill_all()
        await self._to_its_end(process.over())
        process.close()
        await self._to_its_end(asyncio.to_thread(self._folder.remove))

    async def _to_its_end(self, awaited: Coroutine[Any, Any, _T]) -> _T:
        """Do this to its end even if the caller is cancelled, one after the other."""
        going = asyncio.ensure_future(_after(frozenset(self._going), awaited))
        self._going.add(going)
        going.add_done_callback(self._going.discard)
        return await asyncio.shield(going)

    def _failure(self, code: str, message: str) -> PlannerFailed:
        return PlannerFailed(Problem(code, message, where=f"planner {self.name}"))


async def _after(others: frozenset[asyncio.Future[Any]], awaited: Coroutine[Any, Any, _T]) -> _T:
    if others:
        await asyncio.wait(others)
    return await awaited
