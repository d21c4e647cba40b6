"""The states of small problems, and all that can be done in them."""

from __future__ import annotations

from collections.abc import Mapping

from hypothesis import assume
from tests.planning.differential.semantics import Problem, State, TooManyStates, reachable

from nondum.planning.ground.exploration import explore
from nondum.planning.ground.literal_task import expanded
from nondum.planning.ground.negation import positive_task
from nondum.sdk.planner import GroundTask
from nondum_pddl_workbench.standalone import Standalone

Graph = Mapping[State, frozenset[tuple[str, State]]]


MOST_STATES = 150


def all_that_can_be_done(loaded: Standalone) -> GroundTask:
    """The task with what does not help, too."""
    found = explore(loaded.merged, loaded.facts)
    return positive_task(expanded(loaded.merged, found, loaded.goal), found.table)


def small(problem: Problem) -> Graph:
    """The graph of a problem, unless it is too large to look at."""
    try:
        return reachable(problem, most=MOST_STATES)
    except TooManyStates:
        assume(False)
        raise
