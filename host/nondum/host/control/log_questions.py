"""What people's tools may ask about the past: the journal, and what components have written."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any, cast

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.catalogue.journal import Since
from nondum.host.control.arguments import Arguments
from nondum.host.control.rows import (
    journal_row,
)
from nondum.host.core.records.moment import Moment
from nondum.host.core.row import Row
from nondum.host.core.unknown import unknown
from nondum.host.workers.workers import Workers
from nondum.sdk.errors import NondumError
from nondum.sdk.frozen import frozen

MOST_JOURNAL_ROWS = 100_000
LONGEST_AGO_S = 100 * 366 * 86_400


@frozen
class LogQuestions:
    """Each method is a verb; none changes anything."""

    catalogue: Catalogue
    workers: Workers

    async def journal(self, arguments: Arguments) -> list[Row]:
        """What happened, oldest first; with `since_s`, in the last `since_s` seconds."""
        return await self._journal(arguments)

    async def logs(self, arguments: Arguments) -> list[Row]:
        """What components have written, by time; with `since_s`, in the last `since_s` seconds.

        Raises `NondumError` (COMPONENT_UNKNOWN).
        """
        return self._logs(arguments)

    async def follow_journal(self, arguments: Arguments) -> AsyncIterator[Row]:
        """An entry after the other: what `journal` answers, and what comes."""
        after, loss = 0, self.catalogue.loss
        while True:
            commits = self.catalogue.commits
            if loss is not self.catalogue.loss:  # another file, which counts from 1 again
                after, loss = 0, self.catalogue.loss
            for row in await self._journal(arguments, after=after):
                after = cast(int, row["id"])
                yield row
            await self.catalogue.changed(commits)

    async def follow_logs(self, arguments: Arguments) -> AsyncIterator[Row]:
        """A line after the other: what `logs` answers, and what comes.

        To who reads more slowly than lines come, those are lost that are not kept any more. Raises
        `NondumError` (COMPONENT_UNKNOWN).
        """
        after = 0
        while True:
            version = self.workers.logs.version
            for row in self._logs(arguments, after=after):
                yield row
            after = version
            await self.workers.logs.changed(version)

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        return {"journal": self.journal, "logs": self.logs}

    def following(self) -> dict[str, Callable[[Arguments], AsyncIterator[Any]]]:
        """Verbs that go on answering."""
        return {"follow_journal": self.follow_journal, "follow_logs": self.follow_logs}

    async def _journal(self, arguments: Arguments, *, after: int = 0) -> list[Row]:
        limit = arguments.number("limit", 200, at_least=1, at_most=MOST_JOURNAL_ROWS)
        since = _moment(arguments)
        entries = await self.catalogue.journal(
            subject=arguments.optional_text("subject"),
            after=after,
            since=Since(self.catalogue.boot, since) if since else None,
            limit=MOST_JOURNAL_ROWS if after else limit,
        )
        return [journal_row(entry) for entry in entries]

    def _logs(self, arguments: Arguments, *, after: int = 0) -> list[Row]:
        logs, named = self.workers.logs, arguments.optional_text("component")
        known = {*logs.components(), *(c.id for c in self.catalogue.snapshot().components)}
        if named is not None and named not in known:
            raise NondumError(unknown("component", named, known))
        since = _moment(arguments)
        rows = [
            {"component": name, "when": line.at.wall_s, "level": line.level, "message": line.text}
            for name in ([named] if named else logs.components())
            for line in logs.of(name, after)
            if since is None or line.at.monotonic_s >= since.monotonic_s
        ]
        return sorted(rows, key=lambda row: cast(float, row["when"]))


def _moment(arguments: Arguments) -> Moment | None:
    """The moment that is `since_s` seconds ago, by both clocks; None: no such bound is given."""
    ago_s = arguments.number("since_s", 0, at_least=0, at_most=LONGEST_AGO_S)
    return Moment(time.monotonic() - ago_s, time.time() - ago_s) if ago_s else None
