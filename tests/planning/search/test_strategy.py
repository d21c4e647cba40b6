"""The native planner finds a plan where there is one, and proves it where there is none."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys

import pytest
from hypothesis import given
from tests.planning.search.random_tasks import holds_after, shortest, tasks
from tests.planning.tasks import (
    FOLLOW_PLAN,
    Written,
    delivery_task,
    follow_task,
    gripper_task,
    ground,
    plan_of,
)

from nondum.planning.search import solve
from nondum.sdk.planner import (
    AlreadyTrue,
    ConditionalEffect,
    GaveUp,
    GroundAction,
    GroundTask,
    Layer,
    Plan,
    Rule,
    Unsolvable,
)


def never() -> bool:
    return False


def action(
    name: str, needs: set[int], gives: set[int], takes: set[int], cost: int = 1
) -> GroundAction:
    return GroundAction(name, frozenset(needs), frozenset(gives), frozenset(takes), cost)


def task(goal: set[int], *actions: GroundAction, derived: tuple[Layer, ...] = ()) -> GroundTask:
    """Fact 0 holds at first."""
    facts = tuple(f"f{index}" for index in range(6))
    return GroundTask(facts, frozenset({0}), frozenset(goal), actions, derived)


def counter(bits: int) -> GroundTask:
    """Counting to 2^bits, one action a step: fact 2i says that bit i is off, 2i+1 that it is on."""
    actions = []
    for bit in range(bits):
        ones = {2 * lower + 1 for lower in range(bit)}
        zeros = {2 * lower for lower in range(bit)}
        actions.append(
            action(f"carry {bit}", {2 * bit} | ones, {2 * bit + 1} | zeros, {2 * bit} | ones)
        )
    facts = tuple(f"bit{index // 2} {index % 2}" for index in range(2 * bits))
    off, on = frozenset(range(0, 2 * bits, 2)), frozenset(range(1, 2 * bits, 2))
    return GroundTask(facts, off, on, tuple(actions))


@given(tasks())
def test_answer_agrees_with_looking_at_every_state(random_task: GroundTask) -> None:
    length = shortest(random_task)
    answer = solve(random_task, never)
    match answer:
        case Plan(steps, cost):
            assert holds_after(random_task, steps)
            assert cost == sum(random_task.actions[step].cost for step in steps)
            assert length
        case AlreadyTrue():
            assert length == 0
        case _:
            assert isinstance(answer, Unsolvable)
            assert length is None


@pytest.mark.parametrize(
    "known",
    [gripper_task(3), delivery_task(), follow_task()],
    ids=["gripper", "delivery", "follow"],
)
def test_known_tasks_are_solved(known: GroundTask) -> None:
    answer = solve(known, never)
    assert isinstance(answer, Plan)
    assert holds_after(known, answer.steps)


def test_plan_names_actions_by_index() -> None:
    assert solve(follow_task(), never) == plan_of(follow_task(), *FOLLOW_PLAN)


def test_goal_that_holds_needs_no_plan() -> None:
    assert solve(task({0}), never) == AlreadyTrue()


def test_unreachable_goal_is_named() -> None:
    assert solve(task({3}, action("a", {0}, {1}, set())), never) == Unsolvable("relaxed", ("f3",))


def test_goals_that_exclude_each_other_are_proved_by_exhaustion() -> None:
    choice = task({1, 2}, action("a", {0}, {1}, {0}), action("b", {0}, {2}, {0}))
    assert solve(choice, never) == Unsolvable("exhausted")


def test_action_without_condition_is_used() -> None:
    assert solve(task({1}, action("a", set(), {1}, set())), never) == Plan((0,), 1)


def test_what_is_added_and_deleted_holds() -> None:
    assert solve(task({0, 1}, action("a", {0}, {0, 1}, {0})), never) == Plan((0,), 1)


def test_conditional_effects_of_one_action_happen_together() -> None:
    """All conditions are read before anything changes."""
    swap = GroundAction(
        "swap",
        frozenset(),
        frozenset(),
        frozenset(),
        conditional=(
            ConditionalEffect(frozenset({0}), frozenset({1}), frozenset({0})),
            ConditionalEffect(frozenset({1}), frozenset({0, 2}), frozenset({1})),
        ),
    )
    assert solve(task({0, 2}, swap), never) == Plan((0, 0), 2)


def test_condition_added_by_another_effect_wins() -> None:
    both = GroundAction(
        "both",
        frozenset({0}),
        frozenset(),
        frozenset({0}),
        conditional=(ConditionalEffect(frozenset({0}), frozenset({0, 1}), frozenset()),),
    )
    assert solve(task({0, 1}, both), never) == Plan((0,), 1)


def test_derived_goal_is_reached_through_its_rules() -> None:
    layer = Layer((Rule(2, frozenset({1})), Rule(3, frozenset({2, 0}))))
    given = task({3}, action("a", {0}, {1}, set()), derived=(layer,))
    assert solve(given, never) == Plan((0,), 1)


def test_derived_fact_is_made_false() -> None:
    """Both ways to the derived fact must be closed before its complement holds."""
    layer = Layer((Rule(2, frozenset({0})), Rule(2, frozenset({1}))), ((2, 3),))
    given = task(
        {3},
        action("close one", {0}, {1}, {0}),
        action("close other", {1}, set(), {1}),
        derived=(layer,),
    )
    assert solve(given, never) == Plan((0, 1), 2)


def test_facts_that_support_each_other_only_do_not_hold() -> None:
    layer = Layer((Rule(2, frozenset({3})), Rule(3, frozenset({2})), Rule(3, frozenset({0}))))
    complement = Layer((), ((2, 4),))
    given = task({4}, action("cut", {2}, {1}, {0}), derived=(layer, complement))
    assert solve(given, never) == Plan((0,), 1)


def test_cheaper_way_is_chosen() -> None:
    ways = task(
        {3},
        action("dear", {0}, {3}, set(), 9),
        action("first", {0}, {1}, set(), 2),
        action("second", {1}, {2}, set(), 2),
        action("third", {2}, {3}, set(), 2),
    )
    assert solve(ways, never) == Plan((1, 2, 3), 6)


def test_shorter_of_equal_ways_is_chosen() -> None:
    ways = task(
        {2},
        action("first", {0}, {1}, set(), 2),
        action("second", {1}, {2}, set(), 2),
        action("at once", {0}, {2}, set(), 4),
    )
    assert solve(ways, never) == Plan((2,), 4)


def test_search_gives_up_when_the_time_is_up() -> None:
    looks = iter([False] * 3)
    assert isinstance(solve(counter(40), lambda: next(looks, True)), GaveUp)


def test_long_plan_without_choice_is_found() -> None:
    answer = solve(counter(10), never)
    assert isinstance(answer, Plan)
    assert len(answer.steps) == 2**10 - 1


def test_order_of_facts_does_not_matter() -> None:
    straight = delivery_task()
    count = len(straight.facts)

    def turned(facts: frozenset[int]) -> frozenset[int]:
        return frozenset(count - 1 - fact for fact in facts)

    reversed_ = GroundTask(
        straight.facts[::-1],
        turned(straight.init),
        turned(straight.goal),
        tuple(
            GroundAction(a.name, turned(a.precondition), turned(a.add), turned(a.delete), a.cost)
            for a in straight.actions
        ),
    )
    assert solve(reversed_, never) == solve(straight, never)


def test_answer_does_not_depend_on_the_hash_seed() -> None:
    program = (
        "import pickle, sys;"
        "from nondum.planning.search import solve;"
        "print(solve(pickle.load(sys.stdin.buffer), lambda: False))"
    )
    answers = {
        subprocess.run(
            [sys.executable, "-c", program],
            input=pickle.dumps(gripper_task(4)),
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(answers) == 1
    assert b"steps=" in answers.pop()


def test_dead_end_is_left() -> None:
    """The nearer way ends where the second goal can no longer be reached."""
    ways = ground(
        [
            Written("burn", "key", "open, -key"),
            Written("turn", "key, oil", "open"),
            Written("oil", "can", "oil, -can"),
            Written("lock", "open, key", "locked"),
        ],
        "key, can",
        "open, locked",
    )
    assert solve(ways, never) == plan_of(ways, "oil", "turn", "lock")
