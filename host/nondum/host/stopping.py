"""Stopping: all goals are given up and all behaviours halted, by a word or a command.

It needs no planner, no payload and no peer. Software is no emergency stop: docs/stopping.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from nondum.host.mind.mind import Mind
from nondum.host.workers.workers import Workers
from nondum.planning.stop_words import is_stop_for_other
from nondum.sdk.errors import GoalRefused


@dataclass(frozen=True, slots=True)
class Stopped:
    """What was stopped."""

    goals: tuple[str, ...]
    """Those that were open."""
    behaviours: tuple[str, ...]
    """Those that ran, and were asked to end."""
    peers: tuple[str, ...] = ()
    """Hosts that have stopped as well."""

    def __str__(self) -> str:
        """For people."""
        who = f", with {' and '.join(self.peers)}" if self.peers else ""
        if not self.goals and not self.behaviours:
            return f"stopped{who}: nothing was asked for, nothing was running"
        counted = (_counted(len(self.goals), "goal"), _counted(len(self.behaviours), "behaviour"))
        return f"stopped{who}: {' and '.join(filter(None, counted))} halted"

    def with_peers(self, *peers: str) -> Stopped:
        """It, with hosts that have stopped as well."""
        return replace(self, peers=(*self.peers, *peers))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for people's tools."""
        return {
            "goals": list(self.goals),
            "halted": list(self.behaviours),
            "peers": list(self.peers),
        }


class Stopping:
    """Stops what one host does."""

    def __init__(
        self, mind: Callable[[], Mind], workers: Workers, told: Callable[[Stopped], None]
    ) -> None:
        """`mind` is asked for when it is needed; `told` is called each time, after all is done."""
        self._mind, self._workers, self._told = mind, workers, told

    def stop(self) -> Stopped:
        """Give up all goals, and halt all behaviours, those that run for peers, too.

        Returns at once; how long a behaviour may take to end is bounded.
        """
        mind = self._mind()
        goals = tuple(goal.id for goal in mind.queue if not goal.state.is_final)
        behaviours = mind.halt(now=True)
        self._workers.halt_all()
        stopped = Stopped(goals, behaviours)
        self._told(stopped)
        return stopped


def is_stop_for_stranger(words: str, mind: Mind) -> bool:
    """Whether words stop somebody whose name no host here has, and no phrase makes a goal of them.

    The callers look for the names of known hosts first. As no one knows who was meant, all stop.
    """
    if not is_stop_for_other(words):
        return False
    if mind.composition is None:
        return True
    try:
        mind.composition.book.goal(words)
    except GoalRefused:
        return True
    return False


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'s' if number != 1 else ''}" if number else ""
