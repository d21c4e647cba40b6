"""What people ask the robot about itself is answered in one sentence, and spoken where something
speaks; no plan, payload or peer is needed for it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Iterable

from nondum.host.catalogue.records import PayloadRecord
from nondum.host.mind.answers import abilities, activity
from nondum.host.mind.mind import Mind
from nondum.host.rows import is_at_rest
from nondum.planning.asking import Question, question_in


class Answering:
    """Answers for one host."""

    def __init__(
        self,
        mind: Mind,
        payloads: Callable[[], Iterable[PayloadRecord]],
        busy: Callable[[], Collection[str]],
    ) -> None:
        """`busy` tells the components of this host that carry something out."""
        self._mind, self._payloads, self._busy = mind, payloads, busy

    async def answer(self, words: str) -> str | None:
        """Answer a question, and tell people so; None: it is none of those that are known."""
        question = question_in(words, self._mind.beliefs.snapshot.host)
        if question is None:
            return None
        told = await self._answered(question)
        self._mind.people.tell(told)
        return told

    async def _answered(self, question: Question) -> str:
        views = self._mind.views
        coming = sum(not is_at_rest(payload) for payload in self._payloads())
        if question is Question.ABILITIES:
            found = await asyncio.to_thread(views.goals())
            return abilities(found["can"], coming)
        plan = views.plan()
        steps = [row for one in (plan, *plan["beside"]) for row in one["steps"]]
        lent = {*self._busy()} - {row["component"] for row in steps}
        return activity(views.given(), steps, lent, coming)
