"""Mistakes of a plugin that its worker has outlived: kept as long as the worker, each told once."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.host.core.events.workers import WorkerFaulted
from nondum.sdk.errors import Problem

SHOWN = 3
"""The newest are shown with the component."""
MOST = 100
"""Different ones of one worker that are told at all."""


class Faults:
    """What is wrong with one worker's plugin, by code and place."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, str], Problem] = {}
        self._ended: dict[str, str] = {}
        """Condition → the place where it ended: a worker may say so again and again."""

    def __iter__(self) -> Iterator[Problem]:
        """The newest, without those that ended a condition: the worker tells of such an end."""
        ended = {*self._ended.values()}
        left = [problem for (_, at), problem in self._known.items() if at not in ended]
        yield from left[-SHOWN:]

    def end(self, condition: str, place: str) -> None:
        """A condition has ended at a place, `where` as of faults there."""
        self._ended[condition] = place

    def take(self, faulted: WorkerFaulted) -> bool:
        """Take in one more. Says whether it is new and to be told."""
        fresh = {
            (problem.code, problem.where): problem
            for problem in faulted.problems
            if (problem.code, problem.where) not in self._known
        }
        if not fresh or len(self._known) >= MOST:
            return False
        self._known.update(fresh)
        return True
