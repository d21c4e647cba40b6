"""Random tasks with what the searches make of them, and states that can be reached."""

from __future__ import annotations

from hypothesis import assume
from hypothesis import strategies as st
from tests.planning.search.random_tasks import tasks

from nondum.planning.ground.delete_relaxation import reachable_facts
from nondum.planning.ground.progression import State, progress, start
from nondum.planning.search import encoding
from nondum.planning.search.encoding import Encoded, encode
from nondum.sdk.planner import GroundTask

Walk = tuple[GroundTask, Encoded, list[tuple[State, encoding.State]]]
"""A task, the same encoded, and states of a way through both."""


def encoded_task(task: GroundTask) -> Encoded:
    """A task as `solve` encodes it."""
    return encode(task, reachable_facts(task))


@st.composite
def walks(draw: st.DrawFn) -> Walk:
    """A task, the same encoded, and the states of a way through both, side by side."""
    task = draw(tasks())
    reached = reachable_facts(task)
    assume(task.goal <= reached)
    encoded = encode(task, reached)
    way = [(start(task), encoded.init)]
    for _ in range(draw(st.integers(0, 4))):
        state, mask = way[-1]
        moves = [m for m in encoded.moves if m.precondition & mask == m.precondition]
        if not moves:
            break
        move = draw(st.sampled_from(moves))
        way.append((progress(task, state, task.actions[move.action]), encoded.after(mask, move)))
    return task, encoded, way
