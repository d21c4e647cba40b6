"""Small random tasks with everything that ground tasks can have, and the answer that is true."""

from __future__ import annotations

from hypothesis import strategies as st

from nondum.planning.ground.progression import progress, start
from nondum.sdk.planner import ConditionalEffect, GroundAction, GroundTask, Layer, Rule

BASIC = 5
"""Facts 0 to 4 are changed by actions."""
DERIVED = ((5, 6), (8,))
"""Facts that follow, by layer; …"""
COMPLEMENTS = ((5, 7), (8, 9))
"""… and those that hold where they do not."""
FACTS = 10


def some(facts: range | tuple[int, ...], most: int) -> st.SearchStrategy[frozenset[int]]:
    """A few of these facts."""
    return st.frozensets(st.sampled_from(facts), max_size=most)


@st.composite
def layers(draw: st.DrawFn) -> tuple[Layer, ...]:
    """No layer, one, or two; rules may be cyclic within their layer."""
    made = []
    below: tuple[int, ...] = tuple(range(BASIC))
    for heads, complement in zip(DERIVED, COMPLEMENTS, strict=True):
        bodies = some((*below, *heads), 2)
        rules = draw(st.lists(st.builds(Rule, st.sampled_from(heads), bodies), max_size=4))
        made.append(Layer(tuple(rules), (complement,)))
        below += (*heads, complement[1])
    return tuple(made[: draw(st.integers(0, len(made)))])


@st.composite
def tasks(draw: st.DrawFn) -> GroundTask:
    """A task; about half of those drawn have a plan."""
    derived = draw(layers())
    known = tuple(range((BASIC, 8, FACTS)[len(derived)]))
    basic = range(BASIC)
    effect = st.builds(ConditionalEffect, some(known, 2), some(basic, 2), some(basic, 2))
    action = st.builds(
        GroundAction,
        st.just("act"),
        some(known, 3),
        some(basic, 2),
        some(basic, 2),
        st.integers(0, 3),
        st.lists(effect, max_size=2).map(tuple),
    )
    return GroundTask(
        facts=tuple(f"f{fact}" for fact in known),
        init=draw(some(basic, 3)),
        goal=draw(some(known, 3)),
        actions=tuple(draw(st.lists(action, max_size=6))),
        derived=derived,
    )


def shortest(task: GroundTask) -> int | None:
    """The length of a shortest plan, by looking at every state; None where there is no plan."""
    seen = {start(task)}
    frontier, length = seen, 0
    while frontier:
        if any(task.goal <= state for state in frontier):
            return length
        frontier = {
            progress(task, state, action)
            for state in frontier
            for action in task.actions
            if action.precondition <= state
        } - seen
        seen |= frontier
        length += 1
    return None


def holds_after(task: GroundTask, steps: tuple[int, ...]) -> bool:
    """Whether every step can be taken, and the goal holds after the last."""
    state = start(task)
    for step in steps:
        if not task.actions[step].precondition <= state:
            return False
        state = progress(task, state, task.actions[step])
    return task.goal <= state
