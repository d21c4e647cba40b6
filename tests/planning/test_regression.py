"""The least rest of a plan: it reaches the goal in any order it allows, and is never too long."""

from __future__ import annotations

from random import Random

from hypothesis import given
from hypothesis import strategies as st
from tests.planning.tasks import FOLLOW_LASTING, FOLLOW_PLAN, follow_task, plan_of

from nondum.planning.execute.partial_order import GOAL, bits
from nondum.planning.execute.regression import Regression, Rest, Stuck
from nondum.planning.execute.step import Step, steps_of, words
from nondum.sdk.planner import GroundAction

FACTS = [f"f{i}" for i in range(7)]
some_facts = st.frozensets(st.sampled_from(FACTS), max_size=3)


@st.composite
def valid_plans(draw: st.DrawFn) -> tuple[Regression, frozenset[str]]:
    """A plan whose steps are possible one after the other, and a goal that it reaches."""
    state = start = draw(st.frozensets(st.sampled_from(FACTS)))
    steps: list[Step] = []
    for index in range(draw(st.integers(0, 7))):
        available = sorted(state)
        needs = draw(st.frozensets(st.sampled_from(available), max_size=2)) if available else ()
        add, delete = draw(some_facts), draw(some_facts)
        precondition, delete = frozenset(needs), delete - add
        action = GroundAction(f"a{index}", frozenset(), frozenset(), frozenset())
        steps.append(Step(action, precondition, add, delete, False, precondition - delete))
        state = state - delete | add
    goal = draw(st.frozensets(st.sampled_from(sorted(state)))) if state else frozenset[str]()
    return Regression(steps, goal), start


def shortest_triangle(regression: Regression, facts: frozenset[str]) -> int | None:
    """How many steps a triangle table would still do, or None where no row holds."""
    needed, lengths = regression.goal, [0] if regression.goal <= facts else []
    for done, step in enumerate(reversed(regression.steps), start=1):
        needed = needed - step.add | step.precondition
        if needed <= facts:
            lengths.append(done)
    return min(lengths, default=None)


@given(valid_plans(), st.frozensets(st.sampled_from(FACTS)), st.integers())
def test_rest_reaches_goal_in_any_allowed_order(
    plan: tuple[Regression, frozenset[str]], facts: frozenset[str], seed: int
) -> None:
    regression, _ = plan
    rest = regression.rest(facts)
    if isinstance(rest, Stuck):
        return
    random, left, state = Random(seed), rest.steps, facts
    while left:
        index = random.choice(list(regression.order.first_of(left)))
        step = regression.steps[index]
        assert step.precondition <= state
        state = state - step.delete | step.add
        left ^= 1 << index
    assert regression.goal <= state


@given(valid_plans(), st.frozensets(st.sampled_from(FACTS)))
def test_rest_is_no_longer_than_triangle_table(
    plan: tuple[Regression, frozenset[str]], facts: frozenset[str]
) -> None:
    regression, _ = plan
    longest = shortest_triangle(regression, facts)
    rest = regression.rest(facts)
    if longest is not None:
        assert isinstance(rest, Rest)
        assert rest.steps.bit_count() <= longest


@given(valid_plans())
def test_valid_plan_is_supported_where_it_starts(plan: tuple[Regression, frozenset[str]]) -> None:
    regression, start = plan
    assert isinstance(regression.rest(start), Rest)


@given(valid_plans(), st.frozensets(st.sampled_from(FACTS)))
def test_empty_rest_means_that_goal_holds(
    plan: tuple[Regression, frozenset[str]], facts: frozenset[str]
) -> None:
    regression, _ = plan
    assert (regression.rest(facts) == Rest(0)) == (regression.goal <= facts)


def follow() -> Regression:
    task = follow_task()
    steps = steps_of(task, plan_of(task, *FOLLOW_PLAN), FOLLOW_LASTING)
    return Regression(steps, words(task, task.goal))


def test_stuck_names_what_is_missing_and_who_needs_it() -> None:
    regression = follow()
    stuck = regression.rest(frozenset({"free cam-img", "idle base"}))
    assert isinstance(stuck, Stuck)
    assert "ready cam" in stuck.facts
    assert all(link.provider is None for link in stuck.missing)
    assert [link.consumer for link in stuck.missing] == [0, 1, 1, 2, 2, 3]


def test_later_point_is_taken_when_the_world_is_there() -> None:
    regression = follow()
    facts = frozenset({"steers trk-cmd r", "ready base", "idle base"})
    rest = regression.rest(facts)
    assert isinstance(rest, Rest)
    assert list(bits(rest.steps)) == [3]
    assert regression.needs(rest.steps) == facts


def test_goal_links_say_who_provides() -> None:
    assert [link.provider for link in follow().needs_of(GOAL)] == [3]
