"""Goals that peers have of this host's people, as they were last heard of.

What a peer says of one is a stranger's word: bounded, and shown as plain text.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from typing import Any

from nondum.host.core.printable import printable
from nondum.host.core.row import Row
from nondum.sdk.errors import GoalRefused, Problem

MOST_KEPT = 50
"""Goals that are remembered."""
LONGEST = 1000
"""Characters of a text in a row."""
MOST_PROBLEMS = 4
MOST_REPLACED = 4
UNKNOWN = "unknown"
"""State of a goal whose host is gone."""
_OVER = frozenset({"reached", "halted", UNKNOWN})


class ForwardedGoals:
    """Rows as those of own goals (`GivenGoal.to_dict`, `holds`), with the `host` that has it."""

    def __init__(self) -> None:
        self._rows: dict[tuple[str, str], Row] = {}
        self._news = asyncio.Event()

    def rows(self) -> list[Row]:
        """All of them, in the order in which they were given."""
        return list(self._rows.values())

    def add(self, host: str, words: str, priority: int, answer: Mapping[str, Any]) -> Row:
        """Add the goal that a peer has made of words, from the peer's answer."""
        id = _text(answer.get("goal"))
        row: Row = {
            "id": id,
            "host": host,
            "is_elsewhere": True,
            "goal": _text(answer.get("pddl")),
            "text": words,
            "kind": _text(answer.get("kind")),
            "priority": priority,
            "state": "queued",
            "reason": "",
            "problems": [],
            "resumable": False,
            "holds": False,
            "replaces": _replaced(answer.get("replaces")),
        }
        self._rows.pop((host, id), None)
        if len(self._rows) >= MOST_KEPT:
            del self._rows[next(iter(self._rows))]
        self._rows[host, id] = row
        self._tell()
        return dict(row)

    def hear(self, host: str, told: Mapping[str, Any]) -> None:
        """A peer tells how a goal stands, see `goal_status`; of one that was not given, nothing."""
        row = self._rows.get((host, _text(told.get("goal"))))
        if row is None:
            return
        problems = told.get("problems")
        row |= {name: _text(told.get(name)) for name in ("state", "reason")}
        row["holds"] = told.get("holds") is True
        row["replaces"] = _replaced(told.get("replaces"))
        row["problems"] = [
            {name: _text(problem.get(name)) for name in ("code", "message", "where", "fix")}
            for problem in (problems if isinstance(problems, list) else [])[:MOST_PROBLEMS]
            if isinstance(problem, dict)
        ]
        self._tell()

    def lose(self, host: str) -> None:
        """A peer is gone: what becomes of its goals is not known."""
        for (at, _), row in self._rows.items():
            if at == host and row["state"] not in _OVER:
                row |= {"state": UNKNOWN, "reason": f"the host {host} is gone", "holds": False}
        self._tell()

    def lost(self, host: str) -> list[Row]:
        """Those whose host went away, and of which nothing is known since."""
        return [
            dict(row)
            for (at, _), row in self._rows.items()
            if at == host and row["state"] == UNKNOWN
        ]

    async def follow(self, host: str, id: str) -> AsyncIterator[Row]:
        """One of them, now and whenever there is news. Raises `GoalRefused` (GOAL_UNKNOWN)."""
        while True:
            news, row = self._news, self._rows.get((host, id))
            if row is None:
                told = f"no goal {id!r} was given to {host} from here"
                raise GoalRefused(Problem("GOAL_UNKNOWN", told))
            yield dict(row)
            await news.wait()

    def _tell(self) -> None:
        self._news.set()
        self._news = asyncio.Event()


def goal_status(row: Mapping[str, Any]) -> dict[str, Any]:
    """What is told of a goal's row to the host that gave it."""
    problems = [
        {
            name: str(problem.get(name) or "")[:LONGEST]
            for name in ("code", "message", "where", "fix")
        }
        for problem in row["problems"][:MOST_PROBLEMS]
    ]
    return {
        "goal": row["id"],
        "state": row["state"],
        "reason": row["reason"][:LONGEST],
        "holds": row["holds"],
        "problems": problems,
        "replaces": replaced(row),
    }


def replaced(row: Mapping[str, Any]) -> list[dict[str, Any]]:
    """What is told of the goals whose place a goal takes."""
    return [{**goal, "text": goal["text"][:LONGEST]} for goal in row["replaces"][:MOST_REPLACED]]


def _replaced(told: object) -> list[dict[str, Any]]:
    """The same, as a peer tells it; one of an earlier version does not."""
    return [
        {name: _text(goal.get(name)) for name in ("id", "text")}
        | {"is_over": goal.get("is_over") is True}
        for goal in (told if isinstance(told, list) else [])[:MOST_REPLACED]
        if isinstance(goal, dict)
    ]


def _text(value: object) -> str:
    return printable(value[:LONGEST]) if isinstance(value, str) else ""
