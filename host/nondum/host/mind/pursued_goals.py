"""The goals that are pursued now, each in a task tree, and what still runs of former ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from nondum.host.mind.goals import GoalQueue, urgency
from nondum.host.mind.pursued import Pursued
from nondum.planning.execute.running import Run
from nondum.planning.execute.task_tree import TaskTree


class PursuedGoals:
    """Of one mind. Iterating tells them all, the most urgent first."""

    def __init__(self, queue: GoalQueue) -> None:
        self._queue = queue
        self._pursued: dict[str, Pursued] = {}
        self._left_over: tuple[Run, ...] = ()

    def __iter__(self) -> Iterator[Pursued]:
        """All of them as they are now, the most urgent first."""
        return iter(sorted(self._pursued.values(), key=lambda one: urgency(self._queue[one.goal])))

    def __len__(self) -> int:
        """How many."""
        return len(self._pursued)

    def __contains__(self, goal: object) -> bool:
        """Whether the goal of an id is pursued."""
        return goal in self._pursued

    def of(self, goal: str) -> Pursued | None:
        """How a goal is pursued, if it is."""
        return self._pursued.get(goal)

    @property
    def trees(self) -> tuple[TaskTree, ...]:
        """The task trees to tick."""
        return tuple(one.tree for one in self)

    @property
    def runs(self) -> tuple[Run, ...]:
        """All that was started and has not been seen to end, of these plans and of those before."""
        current = (run for one in self for run in one.tree.control.runs.values())
        return each_once((*current, *self._left_over))

    def put(self, one: Pursued) -> None:
        """Pursue a goal so, instead of as before."""
        self._pursued[one.goal] = one

    def release(self, goal: str) -> tuple[Run, ...] | None:
        """Pursue a goal no longer, and hand over what runs for it; None: it was not pursued."""
        one = self._pursued.pop(goal, None)
        return one.tree.release() if one else None

    def drop(self, because: str, goal: str | None = None) -> tuple[str, ...]:
        """Stop pursuing a goal, or all: everything that runs for it is halted. Gives its names."""
        dropped = [one for one in self if goal in (None, one.goal)]
        runs = [run for one in dropped for run in one.tree.control.runs.values()]
        for one in dropped:
            one.tree.halt(because)
            self._left_over = each_once((*self._left_over, *one.tree.release()))
            del self._pursued[one.goal]
        return tuple(run.step.name for run in each_once(runs))

    def drop_ended(self, because: str) -> tuple[str, ...]:
        """Stop pursuing goals that are over. Gives the names of what is halted."""
        over = [one.goal for one in self if self._queue[one.goal].state.is_final]
        return tuple(name for goal in over for name in self.drop(because, goal))

    def forget_ended(self) -> None:
        """Forget what has ended by now of what ran for former plans."""
        self._left_over = tuple(r for r in self._left_over if not r.action.state.has_ended)


def each_once(runs: Iterable[Run]) -> tuple[Run, ...]:
    """Each run once: those that are being halted are known to every tree."""
    return tuple({id(run): run for run in runs}.values())
