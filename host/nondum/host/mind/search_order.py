"""Which goal a plan is searched for next: one search goes on at a time."""

from __future__ import annotations

from collections.abc import Container, Sequence

from nondum.host.mind.goals import GivenGoal


class Turns:
    """The most urgent goals go first, and none keeps the others from theirs: one that is searched
    for again and again, for the world changes all the time, waits until all had a turn."""

    def __init__(self) -> None:
        self._had: set[int] = set()

    def restart(self) -> None:
        """Something new is known: the most urgent goal is the first again."""
        self._had.clear()

    def next(
        self, due: Sequence[GivenGoal], searched: GivenGoal | None, broken: Container[str]
    ) -> GivenGoal | None:
        """The goal to search for now; `due` are those without a plan that goes on, the most urgent
        first, `searched` is the one of them that is searched for, `broken` the ids of those that
        had a plan until now. What is searched for makes way for more urgent ones only."""
        chosen: GivenGoal | None
        fresh = [goal for goal in due if goal.id in broken or goal.number not in self._had]
        if searched is not None:
            before = due[: due.index(searched)]
            chosen = next((goal for goal in fresh if goal in before), searched)
        else:
            if not fresh:
                self.restart()
            chosen = next(iter(fresh or due), None)
        if chosen is not None:
            self._had.add(chosen.number)
        return chosen
