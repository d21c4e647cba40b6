"""What people ask the robot about itself is answered in one sentence, and spoken where something
speaks; no plan or payload is needed for it. What they ask a peer, by its name, the peer answers."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection, Iterable

from nondum.host.core import waiting
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.status import is_at_rest
from nondum.host.mind.mind import Mind
from nondum.host.people.answers import abilities, activity
from nondum.planning.words.asking import Question, question_in


class Answering:
    """Answers for one host."""

    def __init__(
        self,
        mind: Mind,
        payloads: Callable[[], Iterable[PayloadRecord]],
        busy: Callable[[], Collection[str]],
        ask_peer: Callable[[str], Awaitable[str | None]] | None = None,
    ) -> None:
        """`busy` tells the components of this host that carry something out. `ask_peer` asks the
        peer that words name; None where there are no peers."""
        self._mind, self._payloads, self._busy = mind, payloads, busy
        self._ask_peer = ask_peer

    async def answer(self, words: str) -> str | None:
        """Answer a question, or have the peer that it names do so, and tell people; None: it is
        none of those that are known. Raises `GoalRefused` if the peer does not answer."""
        told = await self.own(words)
        if told is None and self._ask_peer is not None:
            told = await self._ask_peer(words)
        if told is not None:
            self._mind.people.tell(told)
        return told

    async def own(self, words: str) -> str | None:
        """The answer to a question about this host; None: it is none of those that are known."""
        question = question_in(words, self._mind.beliefs.snapshot.host)
        return None if question is None else await self._answered(question)

    async def _answered(self, question: Question) -> str:
        views = self._mind.views
        coming = sum(not is_at_rest(payload) for payload in self._payloads())
        if question is Question.ABILITIES:
            found = await asyncio.to_thread(views.goals())
            components = self._mind.beliefs.snapshot.components
            waits = filter(None, map(waiting.waits_to_act, components))
            return abilities(found["can"], coming, tuple(waits))
        plan = views.plan()
        steps = [row for one in (plan, *plan["beside"]) for row in one["steps"]]
        lent = {*self._busy()} - {row["component"] for row in steps}
        return activity(views.given(), steps, lent, coming)
