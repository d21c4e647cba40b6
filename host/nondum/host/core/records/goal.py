"""Goals that are not over."""

from __future__ import annotations

from nondum.planning.merge.goal import GoalKind
from nondum.sdk.frozen import frozen


@frozen
class GoalRecord:
    """A goal that was given and is not over: a daemon that starts takes it up again."""

    id: str
    text: str
    """As the person gave it."""
    pddl: str
    kind: GoalKind
    priority: int
