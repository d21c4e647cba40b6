"""A plan with conditional effects and derived facts is carried out as one of plain actions."""

from __future__ import annotations

from hypothesis import assume, given
from hypothesis import strategies as st
from tests.planning.search.random_tasks import BASIC, tasks

from nondum.planning.ground.conditional_effects import plain
from nondum.planning.ground.progression import progress, settled
from nondum.planning.pddl.facts import holds
from nondum.planning.search import solve
from nondum.planning.search.validate import validate
from nondum.sdk.planner import (
    AlreadyTrue,
    ConditionalEffect,
    GroundAction,
    GroundTask,
    Layer,
    Plan,
    Rule,
)


def never() -> bool:
    return False


def plan_of(task: GroundTask) -> Plan:
    answer = solve(task, never)
    assume(isinstance(answer, Plan | AlreadyTrue))
    return answer if isinstance(answer, Plan) else Plan((), 0)


def test_step_that_deletes_a_fact_enables_what_needs_it_false() -> None:
    """The last action's conditional effect would undo what it adds, were `a` still true."""
    harm = ConditionalEffect(frozenset({0}), frozenset(), frozenset({2}))
    task = GroundTask(
        ("a", "b", "c"),
        init=frozenset({0, 2}),
        goal=frozenset({1, 2}),
        actions=(
            GroundAction("end-a", frozenset(), frozenset(), frozenset({0}), 1),
            GroundAction("make-b", frozenset(), frozenset({1}), frozenset(), 1, (harm,)),
        ),
    )
    written, steps = plain(task, Plan((0, 1), 2))
    assert validate(written, steps) == ()
    last = written.actions[steps.steps[1]]
    assert [written.facts[fact] for fact in last.precondition] == ["!a"]


@given(tasks())
def test_plain_plan_is_valid_and_has_the_same_steps(task: GroundTask) -> None:
    plan = plan_of(task)
    written, steps = plain(task, plan)
    assert not written.features
    assert validate(written, steps) == ()
    assert [written.actions[i].name for i in steps.steps] == [
        task.actions[i].name for i in plan.steps
    ]


@given(tasks(), st.frozensets(st.integers(0, BASIC - 1)))
def test_rest_that_a_state_supports_reaches_the_goal_from_it(
    task: GroundTask, basic: frozenset[int]
) -> None:
    plan = plan_of(task)
    written, steps = plain(task, plan)
    believed = {task.facts[fact] for fact in basic}
    needed = written.goal
    for place in range(len(plan.steps), -1, -1):
        if place < len(plan.steps):
            step = written.actions[steps.steps[place]]
            needed = (needed - step.add) | step.precondition
        if all(holds(written.facts[fact], believed) for fact in needed):
            assert reaches(task, plan.steps[place:], basic)


def reaches(task: GroundTask, steps: tuple[int, ...], basic: frozenset[int]) -> bool:
    state = settled(task, basic)
    for step in steps:
        if not task.actions[step].precondition <= state:
            return False
        state = progress(task, state, task.actions[step])
    return task.goal <= state


@given(tasks())
def test_plain_steps_change_what_the_plan_changes(task: GroundTask) -> None:
    """What the robot assumes of a step that succeeded is what the action did."""
    plan = plan_of(task)
    written, steps = plain(task, plan)
    state, mirror = settled(task, task.init), written.init
    for index, place in zip(plan.steps, steps.steps, strict=True):
        state = progress(task, state, task.actions[index])
        action = written.actions[place]
        mirror = (mirror - action.delete) | action.add
        assert {f for f in state if f < BASIC} == {f for f in mirror if f < BASIC}


def test_effect_that_would_undo_what_is_needed_is_guarded_against() -> None:
    """Lifting spills what is not covered: so it must stay covered."""
    lift = GroundAction(
        "lift",
        frozenset(),
        add=frozenset({1}),
        delete=frozenset(),
        conditional=(ConditionalEffect(frozenset({2}), frozenset(), frozenset({0})),),
    )
    facts = ("full", "lifted", "uncovered")
    task = GroundTask(facts, frozenset({0}), frozenset({0, 1}), (lift,))
    written, _ = plain(task, Plan((0,), 1))
    [step] = written.actions
    assert {written.facts[fact] for fact in step.precondition} == {"!uncovered"}


def test_derived_goal_stands_on_the_facts_that_it_follows_from() -> None:
    shut = GroundAction("shut", frozenset(), add=frozenset({0}), delete=frozenset())
    rules = (Rule(2, frozenset({0})), Rule(2, frozenset({1})))
    task = GroundTask(
        ("shut", "sealed", "safe"), frozenset(), frozenset({2}), (shut,), (Layer(rules),)
    )
    written, _ = plain(task, Plan((0,), 1))
    assert {written.facts[fact] for fact in written.goal} == {"shut"}
