"""What people ask the robot about itself is answered in one sentence, and spoken where something
speaks; no plan or payload is needed for it. What they ask a peer, by its name, the peer answers."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Collection

from nondum.host.core import waiting
from nondum.host.core.status import is_at_rest
from nondum.host.mind.mind import Mind
from nondum.host.people.answers import abilities, activity, fitting, of_the_robot
from nondum.host.people.feedback.state_reasons import Known
from nondum.host.people.hosts_here import hosts_here
from nondum.host.people.obstacles import obstacle, wish_obstacle
from nondum.host.people.pulling import pulling
from nondum.host.people.recent import recent
from nondum.planning.words.asking import Asked, Question, question_in
from nondum.sdk.errors import GoalRefused


class Answering:
    """Answers for one host."""

    def __init__(
        self,
        mind: Mind,
        known: Callable[[], Known],
        busy: Callable[[], Collection[str]],
        ask_peer: Callable[[str], Awaitable[str | None]] | None = None,
        wall_s: Callable[[], float] = time.time,
    ) -> None:
        """`known` is what the host shows its state by. `busy` tells the components of this host
        that carry something out. `ask_peer` asks the peer that words name; None where there are no
        peers. `wall_s` gives seconds since 1970."""
        self._mind, self._known, self._busy = mind, known, busy
        self._ask_peer, self._wall_s = ask_peer, wall_s

    async def answer(self, words: str) -> str | None:
        """Answer a question, or have the peer that it names do so, and tell people; None: it is
        none of those that are known. Raises `GoalRefused` if the peer does not answer."""
        told = await self.own(words)
        if told is None and self._ask_peer is not None:
            told = await self._ask_peer(words)
        if told is not None:
            self._mind.people.tell(told, is_answer=True)
        return told

    async def own(self, words: str) -> str | None:
        """The answer to a question about this host; None: it is none of those that are known."""
        asked = question_in(words, self._mind.beliefs.snapshot.host)
        return None if asked is None else await self._answered(asked)

    async def _answered(self, asked: Asked) -> str:
        match asked.question:
            case Question.ABILITIES:
                return await self._abilities()
            case Question.ACTIVITY:
                return self._activity()
            case Question.WHY_NOT if asked.about:
                return await self._wish(asked.about)
            case Question.WHY_NOT:
                return obstacle(self._mind.views.given())
            case Question.EVENTS:
                return recent(self._mind.people, self._wall_s())
            case Question.HOSTS:
                snapshot = self._mind.beliefs.snapshot
                return hosts_here(snapshot.host, snapshot.peers)
            case Question.PULLING:
                return pulling(self._known(), self._busy())

    async def _abilities(self) -> str:
        found = await asyncio.to_thread(self._mind.views.goals())
        components = self._mind.beliefs.snapshot.components
        waits = filter(None, map(waiting.waits_to_act, components))
        return abilities(found["can"], self._coming(), tuple(waits))

    def _activity(self) -> str:
        plan = self._mind.views.plan()
        steps = [row for one in (plan, *plan["beside"]) for row in one["steps"]]
        lent = {*self._busy()} - {row["component"] for row in steps}
        return activity(self._mind.views.given(), steps, lent, self._coming())

    async def _wish(self, words: str) -> str:
        try:
            row = await asyncio.to_thread(self._mind.views.wish(words))
        except GoalRefused as refused:
            why = refused.problems[0]
            if why.code == "PHRASE_UNKNOWN":
                return fitting([f"I do not know how to {of_the_robot(words)}"])
            return fitting([f"I cannot: {why.message}"])
        return wish_obstacle(row)

    def _coming(self) -> int:
        """How many payloads are being installed."""
        return sum(not is_at_rest(payload) for payload in self._known().snapshot.payloads)
