"""Goals that payloads bring: given when a payload becomes active, ended when it is withdrawn.

Words that mean nothing yet, since the payload that knows them is not here, are tried again with
every recomposition; so are words that people have had kept. A daemon that starts gives the goals
of payloads again when it activates the payloads again.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any, TypeAlias

from nondum.host.core.elsewhere import Elsewhere
from nondum.host.core.events.daemon import HostStarted
from nondum.host.core.events.event import Emit, Event
from nondum.host.core.events.goals import GoalEnded
from nondum.host.core.events.payloads import PayloadActivated
from nondum.host.core.feedback_state import State, StateReason
from nondum.host.core.records.goal import GoalRecord
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.host.core.status import coming_in
from nondum.host.mind.goals import GivenGoal, GoalState
from nondum.host.mind.mind import Mind
from nondum.host.mind.translation import Understood
from nondum.host.people.conversation import given_goal
from nondum.host.people.feedback.state_reasons import refusal
from nondum.sdk.errors import GoalRefused, Problem
from nondum.sdk.frozen import frozen

log = logging.getLogger(__name__)

WITHDRAWN = "the payload that wants it is withdrawn"
_GIVEN_AGAIN = "its payload gives it again"

Translate: TypeAlias = Callable[[str, GoalRefused], Awaitable[Understood]]
"""Words, and why they match no phrase → what components take them to mean."""


@frozen
class Wish:
    """One line of a goal.txt, or words of a person."""

    id: str
    """Of the goal that is made of it: `<payload id>/<line>`, or a number."""
    payload: str
    """Key of the payload; empty: a person said it."""
    payload_id: str
    words: str
    problem: Problem | None = None
    """Why it is not a goal yet."""
    priority: int = 0
    is_translated: bool = True
    """Whether it counts as what components take it to mean: a person was not asked."""
    while_coming: bool = False
    """It is given up once nothing is being installed that could make it mean something."""


def of_people(goals: Iterable[GoalRecord]) -> Iterator[GoalRecord]:
    """Those that were not brought by payloads: their ids are numbers."""
    return (goal for goal in goals if "/" not in goal.id)


def why_kept(snapshot: Snapshot) -> str:
    """Why words of a person are no goal yet, in words."""
    return coming_in(snapshot) or "nothing that is here understands it"


class GoalFiles:
    """Subscribe `on_event`, and `run` it. Its methods run on the loop."""

    def __init__(
        self,
        snapshot: Callable[[], Snapshot],
        mind: Mind,
        translate: Translate,
        emit: Emit,
        on_change: Callable[[], None] = lambda: None,
        elsewhere: Elsewhere | None = None,
    ) -> None:
        """`on_change` is called when `state_reasons` change; words of people may be goals of
        peers, `elsewhere`."""
        self._snapshot, self._mind, self._translate = snapshot, mind, translate
        self._emit, self._on_change = emit, on_change
        self._elsewhere = elsewhere
        self._wishes: dict[str, Wish] = {}
        """Goal id → the wish that it was made of."""
        self._waiting: set[str] = set()
        """Goal ids of the wishes that are no goals yet."""
        self._coming = ""
        """What was being installed when it was looked at last, see `coming_in`."""
        self._news = asyncio.Event()

    @property
    def state_reasons(self) -> tuple[StateReason, ...]:
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
            if id in self._waiting and wish.problem is not None and wish.payload
        )

    def keep(self, kept: GivenGoal, *, is_translated: bool, while_coming: bool) -> None:
        """Give a goal that the mind keeps as soon as its words mean something, see `Wish`."""
        wish = Wish(kept.id, "", "", kept.text, priority=kept.priority)
        self._wishes[kept.id] = replace(
            wish, is_translated=is_translated, while_coming=while_coming
        )
        self._waiting.add(kept.id)
        self._coming = coming_in(self._snapshot())
        self._news.set()

    def on_event(self, event: Event) -> None:
        """Take in what has happened."""
        if isinstance(event, HostStarted):
            for goal in self._snapshot().goals:
                if goal not in of_people([goal]):
                    self._emit(GoalEnded(goal.id, _GIVEN_AGAIN))
        if event.JOURNALLED and self._wishes:
            self._end_withdrawn()
            coming, self._coming = self._coming, coming_in(self._snapshot())
            if coming != self._coming:
                self._news.set()  # what words wait for may have been refused
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
        brought = [wish for wish in self._wishes.values() if wish.payload]
        gone = [wish for wish in brought if wish.payload not in active]
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
        if not self._is_wished(wish):
            self._forget(wish)
            return
        try:
            if await self._is_given_to_a_peer(wish):
                return
            self._mind.give(words=wish.words, priority=wish.priority, id=id)
        except GoalRefused as refused:
            if self._mind.composition is None:  # too early: there will be one
                return
            if wish.is_translated:
                await self._try_translated(wish, refused)
            else:
                self._refused(wish, refused.problems[0])
        else:
            self._given(wish, f"{_asker(wish)} asks: {wish.words}")

    async def _is_given_to_a_peer(self, wish: Wish) -> bool:
        """Give a peer what a person wants of it, now that it is here. Raises `GoalRefused`."""
        if self._elsewhere is None or wish.payload:
            return False
        peer, words = await self._elsewhere.addressee(wish.words)
        if peer is None or not self._is_wished(wish):
            return False
        given = await self._elsewhere.give(peer, words, wish.priority)
        self._forget(wish)
        self._mind.halt(id=wish.id, why=f"{peer} has it: goal {given['id']} there")
        told = given_goal(given, of=f" of {peer}")
        self._mind.people.tell(f"a person asks {peer}: {words}; {told}")
        return True

    async def _try_translated(self, wish: Wish, refused: GoalRefused) -> None:
        try:
            understood = await self._translate(wish.words, refused)
            if not self._is_wished(wish):
                return
            self._mind.give(
                pddl=understood.pddl,
                kind=understood.kind,
                priority=wish.priority,
                said=wish.words,
                id=wish.id,
            )
        except GoalRefused as error:
            self._refused(wish, error.problems[0])
        else:
            self._given(wish, f"{_asker(wish)} asks: {wish.words}, {understood}")

    def _is_wished(self, wish: Wish) -> bool:
        """Whether it is still; its drive may have been pulled, and another one plugged in, or a
        person may have halted it."""
        now = self._wishes.get(wish.id)
        is_same = now is not None and now.payload == wish.payload
        return is_same and (bool(wish.payload) or self._is_kept(wish.id))

    def _is_kept(self, id: str) -> bool:
        return any(goal.id == id and goal.state is GoalState.KEPT for goal in self._mind.queue)

    def _forget(self, wish: Wish) -> None:
        self._waiting.discard(wish.id)
        self._wishes.pop(wish.id, None)

    def _given(self, wish: Wish, told: str) -> None:
        self._waiting.discard(wish.id)
        if not wish.payload:
            self._forget(wish)
        self._mind.people.tell(told)
        self._on_change()

    def _refused(self, wish: Wish, problem: Problem) -> None:
        if not self._is_wished(wish):
            return
        if not wish.payload:
            self._still_kept(wish, problem)
            return
        if self._wishes[wish.id].problem == problem:
            return
        self._wishes[wish.id] = replace(wish, problem=problem)
        told = f"{wish.payload_id} asks {wish.words!r}, which cannot be wanted now: {problem}"
        self._mind.people.tell(told)
        self._on_change()

    def _still_kept(self, wish: Wish, problem: Problem) -> None:
        """Words of a person mean nothing yet: they wait, or are given up."""
        snapshot, composition = self._snapshot(), self._mind.composition
        assert composition is not None, "they were tried with it"
        coming = coming_in(snapshot)
        is_up_to_date = composition.revision >= snapshot.revision
        if wish.while_coming and not coming and is_up_to_date:
            self._forget(wish)
            self._mind.halt(id=wish.id, why=str(problem))
            return
        self._mind.queue.put(wish.id, GoalState.KEPT, why_kept(snapshot), (problem,))
        self._mind.wake()

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


def _asker(wish: Wish) -> str:
    return wish.payload_id or "a person"
