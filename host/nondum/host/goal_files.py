"""Goals that payloads bring: given when a payload comes into force, and over when it is withdrawn.

Words that mean nothing yet, since the payload that knows them is not here, are tried again with
every recomposition. A daemon that starts gives them anew, as it brings up anew what is plugged in.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from nondum.host.catalogue.records import GoalRecord, Snapshot, Step
from nondum.host.events import Emit, Event, GoalEnded, HostStarted, PayloadActivated
from nondum.host.feedback.concerns import refusal
from nondum.host.feedback.state import Concern, State
from nondum.host.mind.mind import Mind
from nondum.host.mind.translation import Understood
from nondum.sdk.errors import GoalRefused, Problem

log = logging.getLogger(__name__)

WITHDRAWN = "the payload that wants it is withdrawn"
_ANEW = "it is given anew with its payload"

Translate: TypeAlias = Callable[[str, GoalRefused], Awaitable[Understood]]
"""Words, and why they match no phrase → what components take them to mean."""


@dataclass(frozen=True, slots=True)
class Wish:
    """One line of a goal.txt."""

    id: str
    """Of the goal that is made of it: `<payload id>/<line>`."""
    payload: str
    """Key of the payload."""
    payload_id: str
    words: str
    problem: Problem | None = None
    """Why it is not a goal yet."""


def of_people(goals: Iterable[GoalRecord]) -> Iterator[GoalRecord]:
    """Those that were not brought by payloads: their ids are numbers."""
    return (goal for goal in goals if "/" not in goal.id)


class GoalFiles:
    """Subscribe `on_event`, and `run` it. Its methods run on the loop."""

    def __init__(
        self,
        snapshot: Callable[[], Snapshot],
        mind: Mind,
        translate: Translate,
        emit: Emit,
        on_change: Callable[[], None] = lambda: None,
    ) -> None:
        """`on_change` is called when there are other `concerns`."""
        self._snapshot, self._mind, self._translate = snapshot, mind, translate
        self._emit, self._on_change = emit, on_change
        self._wishes: dict[str, Wish] = {}
        """Goal id → the wish that it was made of."""
        self._waiting: set[str] = set()
        """Goal ids of the wishes that are no goals yet."""
        self._news = asyncio.Event()

    @property
    def concerns(self) -> tuple[Concern, ...]:
        """What cannot be wanted as things are."""
        return tuple(
            refusal(
                State.HELP,
                f"goal {wish.id}",
                f"{wish.payload_id} asks {wish.words!r}, which cannot be wanted now",
                [wish.problem],
                payload=wish.payload_id,
            )
            for id, wish in self._wishes.items()
            if id in self._waiting and wish.problem is not None
        )

    def on_event(self, event: Event) -> None:
        """Take in what has happened."""
        if isinstance(event, HostStarted):
            for goal in self._snapshot().goals:
                if goal not in of_people([goal]):
                    self._emit(GoalEnded(goal.id, _ANEW))
        if event.JOURNALLED and self._wishes:
            self._end_withdrawn()
        if isinstance(event, PayloadActivated) and event.goals:
            self._begin(event)

    async def run(self) -> None:
        """Give what is wished, as soon as it means something, until cancelled."""
        while True:
            self._news.clear()
            tried_with = self._mind.composition
            for id in tuple(self._waiting):
                await self._try(id)
            while not self._news.is_set() and self._mind.composition is tried_with:
                await self._until_news()

    def _begin(self, event: PayloadActivated) -> None:
        payloads = {p.key: p for p in self._snapshot().payloads if p.step is Step.ACTIVE}
        payload = payloads.get(event.payload)
        if payload is None:  # it was pulled in the same moment
            return
        for number, words in enumerate(event.goals, start=1):
            id = f"{payload.payload_id}/{number}"
            self._wishes[id] = Wish(id, payload.key, payload.payload_id, words)
            self._waiting.add(id)
        self._news.set()

    def _end_withdrawn(self) -> None:
        active = {p.key for p in self._snapshot().payloads if p.step is Step.ACTIVE}
        gone = [wish for wish in self._wishes.values() if wish.payload not in active]
        for wish in gone:
            del self._wishes[wish.id]
            if wish.id in self._waiting:
                self._waiting.discard(wish.id)
            else:
                self._halt(wish)
        if gone:
            self._on_change()

    def _halt(self, wish: Wish) -> None:
        try:
            self._mind.halt(id=wish.id, why=WITHDRAWN)
        except GoalRefused:  # it was reached long ago, and forgotten
            log.debug("goal %s is over already", wish.id)

    async def _try(self, id: str) -> None:
        wish = self._wishes.get(id)
        if wish is None:
            return
        try:
            self._mind.give(words=wish.words, id=id)
        except GoalRefused as refused:
            if self._mind.composition is None:  # too early: there will be one
                return
            await self._try_translated(wish, refused)
        else:
            self._given(wish, f"{wish.payload_id} asks: {wish.words}")

    async def _try_translated(self, wish: Wish, refused: GoalRefused) -> None:
        try:
            understood = await self._translate(wish.words, refused)
            if not self._is_wished(wish):
                return
            self._mind.give(pddl=understood.pddl, kind=understood.kind, said=wish.words, id=wish.id)
        except GoalRefused as error:
            self._refused(wish, error.problems[0])
        else:
            self._given(wish, f"{wish.payload_id} asks: {wish.words}, {understood}")

    def _is_wished(self, wish: Wish) -> bool:
        """Whether it is still; its drive may have been pulled, and another one plugged in."""
        now = self._wishes.get(wish.id)
        return now is not None and now.payload == wish.payload

    def _given(self, wish: Wish, told: str) -> None:
        self._waiting.discard(wish.id)
        self._mind.people.tell(told)
        self._on_change()

    def _refused(self, wish: Wish, problem: Problem) -> None:
        if not self._is_wished(wish) or self._wishes[wish.id].problem == problem:
            return
        self._wishes[wish.id] = replace(wish, problem=problem)
        told = f"{wish.payload_id} asks {wish.words!r}, which cannot be wanted now: {problem}"
        self._mind.people.tell(told)
        self._on_change()

    async def _until_news(self) -> None:
        """Wait for other wishes, and while any waits, for the mind to look different."""
        waits: list[asyncio.Task[Any]] = [asyncio.create_task(self._news.wait())]
        if self._waiting:
            waits.append(asyncio.create_task(self._mind.changed(self._mind.version)))
        try:
            await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in waits:
                task.cancel()
            await asyncio.gather(*waits, return_exceptions=True)
