"""What the robot is doing and can do, in one line: the status text of the service."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from nondum.host.control.rows import host_state, problems_of
from nondum.host.core.printable import printable
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.snapshot import Snapshot

_DOES = {"active": "does", "suspended": "cannot yet"}
"""State of a goal → what is said of it."""


def words(
    snapshot: Snapshot,
    goals: Sequence[Mapping[str, Any]],
    places: Mapping[str, str],
    warnings: Collection[str] = (),
) -> str:
    """One line: what is at work, what is being done, what a person should see to.

    `goals` are rows as people are shown them, `warnings` what every status says beside problems of
    payloads.
    """
    ready = sum(component.is_ready for component in snapshot.components)
    parts = [
        *(["safe mode"] if snapshot.safety is not Safety.OFF else []),
        *(["taking in a payload"] if host_state(snapshot, places).endswith("working") else []),
        f"{_count(ready, 'component')} at work",
    ]
    if waiting := len(snapshot.components) - ready:
        parts.append(f"{waiting} not ready")
    parts += [
        f"{_DOES[goal['state']]}: {printable(str(goal['text']))}"
        for goal in goals
        if goal["state"] in _DOES
    ]
    problems = [str(problem) for problem in problems_of(snapshot, places)]
    if problems:
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        parts.append(f"needs help: {printable(problems[0])}{more}")
    if warnings:
        parts.append(f"{_count(len(warnings), 'warning')} in `nondum status`")
    return "; ".join(parts)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
