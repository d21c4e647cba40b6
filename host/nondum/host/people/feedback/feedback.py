"""Feedback of a running host: follows events, works out the state, and passes it to the outputs
(lamps, sounds, what is spoken, programs)."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from nondum.host.core.events.catalogue import CatalogueUnwritten, CatalogueWritten
from nondum.host.core.events.drives import DriveRead, DriveReleased, DriveRemoved, DriveUnreadable
from nondum.host.core.events.event import Event
from nondum.host.core.feedback_state import NOTHING, State, StateReason
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.extension.hookspecs import Output
from nondum.host.mind.goals import GivenGoal
from nondum.host.people.feedback import showing
from nondum.host.people.feedback.outputs import Outlet
from nondum.host.people.feedback.showing import Durations, Shown
from nondum.host.people.feedback.state_reasons import Known, refusal, state_reasons
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class Sources:
    """Where it is known from what the host is at."""

    snapshot: Callable[[], Snapshot]
    places: Callable[[], Mapping[str, str]]
    goals: Callable[[], Iterable[GivenGoal]]
    more: Callable[[], tuple[StateReason, ...]] = tuple
    """State reasons that other parts of the host work out."""


class Feedback:
    """Subscribe `on_event`, and `run` it. Its methods run on the loop."""

    def __init__(
        self,
        sources: Sources,
        durations: Durations,
        outputs: Sequence[Output] = (),
        *,
        on_change: Callable[[], None] = lambda: None,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """`on_change` is called whenever another state is shown."""
        self._sources, self._durations, self._now_s = sources, durations, now_s
        self._on_change = on_change
        self._outlets = tuple(Outlet(output, on_change) for output in outputs)
        self._unmounted: frozenset[str] = frozenset()
        self._unwritten: tuple[Problem, ...] = ()
        self._since: showing.Since = {}
        self._shown = Shown(NOTHING, None)
        self._news = asyncio.Event()

    @property
    def now(self) -> StateReason:
        """What is shown now; its `sentence` says it in words."""
        return self._shown.reason

    @property
    def warnings(self) -> tuple[str, ...]:
        """What cannot be shown, and why, for every status."""
        return tuple(problem for outlet in self._outlets for problem in outlet.problems)

    def to_dict(self) -> dict[str, Any]:
        """What is shown now, for people's tools."""
        return self._look().reason.to_dict()

    def on_event(self, event: Event) -> None:
        """Take in what has happened."""
        match event:
            case DriveReleased(drive):
                self._unmounted |= {drive}
            case DriveRead(drive) | DriveUnreadable(drive) | DriveRemoved(drive):
                self._unmounted -= {drive}
            case CatalogueUnwritten(_, problems):
                self._unwritten = problems
            case CatalogueWritten():
                self._unwritten = ()
            case _ if not event.JOURNALLED:
                return
        self.wake()

    def wake(self) -> None:
        """Ask for the state to be worked out again."""
        self._news.set()

    async def run(self) -> None:
        """Show the state, whenever it is another, until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            for outlet in self._outlets:
                tasks.create_task(outlet.run())
            tasks.create_task(self._follow())

    async def _follow(self) -> None:
        last: StateReason | None = None
        while True:
            self._news.clear()
            now = self._look()
            if now.reason != last:
                last = now.reason
                for outlet in self._outlets:
                    outlet.show(last)
                self._on_change()
            await self._until_news(now.until_s)

    async def _until_news(self, until_s: float | None) -> None:
        wait_s = None if until_s is None else max(0.0, until_s - self._now_s())
        try:
            async with asyncio.timeout(wait_s):
                await self._news.wait()
        except TimeoutError:
            return

    def _look(self) -> Shown:
        found, now_s = state_reasons(self.known()), self._now_s()
        self._since = showing.since(self._since, found, now_s)
        self._shown = showing.shown(found, self._since, now_s, self._durations)
        return self._shown

    def known(self) -> Known:
        """All that the state is made of."""
        sources = self._sources
        unwritten = tuple(
            refusal(State.HELP, "catalogue", "what happens is not on disk", [problem])
            for problem in self._unwritten
        )
        return Known(
            sources.snapshot(),
            self._unmounted,
            tuple(sources.places()),
            tuple(sources.goals()),
            (*sources.more(), *unwritten),
        )
