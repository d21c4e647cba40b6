"""Components that can speak say the announcements, and components that can listen hear people.

A sentence that is heard is a question to the robot about itself, or else a goal in words, as if it
had been typed; it is never translated, since no person is asked to confirm it. Components that
listen are sent the sentences that can be said, and again when these change.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, TypeAlias

from nondum.host.mind.component_plugins import Answer, Said
from nondum.host.mind.composition import Composition
from nondum.host.mind.mind import Mind
from nondum.host.people.replaced import replacing
from nondum.host.people.sayings import sayings
from nondum.sdk.errors import GoalRefused

SPEAK_S = 30.0
"""What a component has to say a sentence; then the next one is said."""
UNSAID = 3
"""The number of sentences that may wait to be said: older ones are left out."""
LONGEST_SPOKEN = 160
"""A longer sentence is for reading."""
PAUSE_S = 0.2
"""Between two sentences of one listener, however much it says."""


Take: TypeAlias = Callable[[str], Awaitable[str]]
"""What a person said → what becomes of it, in words. Raises `GoalRefused`."""
Reply: TypeAlias = Callable[[str], Awaitable[str | None]]
"""What a person asked → the answer, which people have been told; None: it is no question. Raises
`GoalRefused` if the peer that is asked does not answer."""


class Conversation:
    """Speaks and listens for one mind, while `run` runs."""

    def __init__(
        self,
        mind: Mind,
        processes: Callable[[], Mapping[str, int]],
        take: Take,
        answer: Reply,
    ) -> None:
        """`processes` are those of running workers, by component: one that does not listen is asked
        again when its component has a new process. `take` makes goals of words,
        here or elsewhere, `answer` says what there is to say to a question."""
        self._mind = mind
        self._answer = answer
        self._take = take
        self._processes = processes
        self._saying = asyncio.Lock()

    async def run(self) -> None:
        """Speak and listen until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._speak())
            tasks.create_task(self._listen())

    async def say(self, text: str) -> None:
        """Have a sentence said by all components that speak, at once; `SPEAK_S` at most."""
        async with self._saying:
            said: list[Said[Answer]] = self._mind.plugins.hook.speak(ctx=None, text=text)
            saying = [asyncio.ensure_future(_awaited(one.value)) for one in said]
            if saying:
                _, late = await asyncio.wait(saying, timeout=SPEAK_S)
                for task in late:
                    task.cancel()

    async def on_words(self, component: str, words: str) -> None:
        """Answer what a person has said, or take it as a goal; announce why if neither is
        possible."""
        try:
            if await self._answer(words) is not None:
                return
            told = await self._take(words)
        except GoalRefused as refused:
            told = str(refused.problems[0])
        self._mind.people.tell(f"{component} heard {words!r}: {told}")

    async def _speak(self) -> None:
        version, said = self._mind.version, self._mind.people.last_number
        while True:
            version = await self._mind.changed(version)
            said = max(said, self._mind.people.last_number - UNSAID)
            for told in self._mind.people.since(said):
                said = told.number
                if len(told.text) <= LONGEST_SPOKEN:
                    await self.say(told.text)

    async def _listen(self) -> None:
        version, listening = -1, dict[tuple[str, int], asyncio.Task[None]]()
        try:
            while True:
                running = self._processes().items()
                present = {key for key in running if self._mind.plugins.plugin(key[0])}
                for gone in listening.keys() - present:
                    listening.pop(gone).cancel()
                for key in present - listening.keys():
                    listening[key] = asyncio.create_task(self._attend(key[0]))
                version = await self._mind.changed(version)
        finally:
            for task in listening.values():
                task.cancel()
            await asyncio.gather(*listening.values(), return_exceptions=True)

    async def _attend(self, component: str) -> None:
        """Hear a component, and teach it beside that."""
        teaching = asyncio.create_task(self._teach(component))
        try:
            await self._hear(component)
        finally:
            teaching.cancel()
            await asyncio.gather(teaching, return_exceptions=True)

    async def _teach(self, component: str) -> None:
        """Tell a component what can be said, each time that it is something else."""
        version, seen, taught = -1, None, None
        while plugin := self._mind.plugins.plugin(component):
            composition = self._mind.composition
            if composition is not None and composition is not seen:
                seen, vocabulary = composition, sayings(composition.book, _hosts(composition))
                if vocabulary != taught:
                    await plugin.learn_words(vocabulary).value
                    taught = vocabulary
            version = await self._mind.changed(version)

    async def _hear(self, component: str) -> None:
        """Hear what a component hears, until it says nothing: then it does not listen."""
        while plugin := self._mind.plugins.plugin(component):
            words = (await plugin.listen().value or {}).get("words")
            if not isinstance(words, str) or not words.strip():
                return
            await self.on_words(component, words)
            await asyncio.sleep(PAUSE_S)


def wanted(mind: Mind, words: str) -> str:
    """Make a goal of words that are heard; says what became of them. Raises `GoalRefused`."""
    return given_goal(mind.views.goal(mind.give(words=words)))


def given_goal(row: Mapping[str, Any], *, of: str = "") -> str:
    """What is said of words that are a goal now, which peer's `of` says."""
    told = f"that is goal {row['id']}{of}"
    return "; ".join(filter(None, (told, replacing(row["replaces"]))))


def _hosts(composition: Composition) -> tuple[str, ...]:
    """Those who can be spoken to."""
    return (composition.host, *(peer.name for peer in composition.snapshot.peers))


async def _awaited(answer: Answer) -> None:
    await answer
