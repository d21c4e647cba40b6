"""Stopping: all goals are given up and all behaviours halted, by a word or a command.

It needs no planner, no payload and no peer. Software is no emergency stop: docs/stopping.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from nondum.host.mind.mind import Mind
from nondum.host.workers.workers import Workers
from nondum.planning.words.addressee import addressed_to
from nondum.planning.words.stop_words import (
    STOPS,
    host_behind_stop,
    is_stop_before_name,
    is_stop_for_other,
)
from nondum.sdk.errors import GoalRefused
from nondum.sdk.frozen import frozen


@frozen
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
    Behind the word, what a phrase has no name for is no host's name either.
    """
    if is_stop_for_other(words):
        return bool(_unsaid(words, mind))
    return is_stop_before_name(words) and _unsaid(words, mind) == "PHRASE_UNKNOWN"


def said_to(words: str, hosts: Sequence[str], mind: Mind) -> tuple[str | None, str]:
    """The host whose name a sentence has, and the sentence without it; None: no host's name.

    The name comes first, or behind a word that stops where no phrase says the whole sentence.
    """
    host, rest = addressed_to(words, hosts)
    if host is None:
        host = host_behind_stop(words, hosts)
        if host is not None:
            return (host, STOPS[0]) if _unsaid(words, mind) else (None, words)
    return host, rest


def _unsaid(words: str, mind: Mind) -> str:
    """Why no phrase makes a goal of words: a code; "" where one does."""
    if mind.composition is None:
        return "PHRASE_UNKNOWN"
    try:
        mind.composition.book.goal(words)
    except GoalRefused as refused:
        return refused.code
    return ""


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'s' if number != 1 else ''}" if number else ""
