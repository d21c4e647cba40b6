"""A running host, watched: everything at a glance, whenever it looks different."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from typing import Any

from nondum.host.control.arguments import Arguments
from nondum.host.control.news import News
from nondum.host.control.status_questions import StatusQuestions
from nondum.host.control.stream_questions import StreamQuestions
from nondum.host.core.row import Row
from nondum.host.mind.mind import Mind
from nondum.sdk.frozen import frozen

LONGEST_EVERY_S = 3600

Version = tuple[int, int]


@frozen
class Watching:
    """Each method that takes arguments is a verb; none changes anything."""

    mind: Mind
    news: News
    of_status: StatusQuestions
    of_streams: StreamQuestions

    async def watch(self, arguments: Arguments) -> AsyncIterator[Row]:
        """Everything at a glance, now and whenever the host looks different; with `every_s`, at
        least so often."""
        every_s = arguments.number("every_s", 0, at_least=0, at_most=LONGEST_EVERY_S)
        version = None
        while True:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(every_s or None):
                    version = await self.changed(version)
            yield {
                **await self.of_status.status(arguments),
                "components": await self.of_status.components(arguments),
                "streams": await self.of_streams.streams(arguments),
                "inputs": await self.of_streams.inputs(arguments),
                "plan": self.mind.views.plan(),
                "tree": self.mind.views.tree(),
            }

    async def changed(self, since: Version | None = None) -> Version:
        """Wait for either the mind or the news to be at another version, and give it."""
        since = since or (-1, -1)
        waiting = [
            asyncio.create_task(self.mind.changed(since[0])),
            asyncio.create_task(self.news.changed(since[1])),
        ]
        try:
            await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in waiting:
                task.cancel()
            await asyncio.gather(*waiting, return_exceptions=True)
        return self.mind.version, self.news.version

    def following(self) -> dict[str, Callable[[Arguments], AsyncIterator[Any]]]:
        """Verbs that go on answering."""
        return {"watch": self.watch}
