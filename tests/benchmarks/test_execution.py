"""The simulation of benchmarks/execution: fair, repeatable, and right about what is true."""

from __future__ import annotations

from random import Random

import pytest
from benchmarks.execution import report, ticking
from benchmarks.execution.__main__ import cells
from benchmarks.execution.backchained import holds_for, settle
from benchmarks.execution.leaves import Check
from benchmarks.execution.planner import Planner
from benchmarks.execution.results import Cell, Results, figures
from benchmarks.execution.robot import SimulatedAction, SimulatedRobot
from benchmarks.execution.scenes import NAMES, Scene, scene
from benchmarks.execution.trial import EXECUTORS, Outcome, run
from benchmarks.execution.troubles import KINDS, Troubles
from benchmarks.measuring import Spread
from py_trees.composites import Selector, Sequence

from nondum.planning.execute.running import RunState
from nondum.planning.execute.step import Step

CALM = KINDS["none"]


@pytest.fixture(scope="module")
def scenes() -> dict[str, Scene]:
    return {name: scene(name) for name in NAMES}


def robot_in(place: Scene, troubles: Troubles = CALM) -> SimulatedRobot:
    return SimulatedRobot(place, troubles, Random(0))


def step(place: Scene, name: str) -> Step:
    action = next(action for action in place.task.actions if action.name == name)
    return Step.from_action(place.task, action, lasting=action.schema in place.lasting)


@pytest.mark.parametrize("name", NAMES)
def test_every_scene_has_a_plan_and_units_that_may_go(scenes: dict[str, Scene], name: str) -> None:
    plan = Planner(scenes[name]).plan(scenes[name].start)
    assert plan is not None
    assert len(plan.steps) >= 8
    ready = {fact for fact in scenes[name].start if fact.startswith("ready ")}
    for number in plan.steps:
        action = scenes[name].task.actions[number]
        assert f"ready {action.arguments[0]}" in ready


@pytest.mark.parametrize("executor", EXECUTORS)
@pytest.mark.parametrize("name", ["gripper", "follow"])
def test_calm_worlds_cause_no_trouble(scenes: dict[str, Scene], name: str, executor: str) -> None:
    place = scenes[name]
    outcome = run(place, Planner(place), EXECUTORS[executor], CALM, seed=1)
    assert outcome.reached


@pytest.mark.parametrize("trouble", KINDS)
@pytest.mark.parametrize("name", NAMES)
def test_task_trees_reach_the_goal_and_never_claim_it_falsely(
    scenes: dict[str, Scene], name: str, trouble: str
) -> None:
    planner = Planner(scenes[name])
    for seed in range(4):
        outcome = run(scenes[name], planner, EXECUTORS["nondum"], KINDS[trouble], seed)
        assert outcome.reached, f"seed {seed}"


def test_open_loop_claims_what_is_not_so(scenes: dict[str, Scene]) -> None:
    place = scenes["gripper"]
    planner, silent = Planner(place), Troubles(silent=0.5)
    outcomes = [run(place, planner, EXECUTORS["open loop"], silent, seed) for seed in range(10)]
    assert any(outcome.is_false for outcome in outcomes)


def test_equal_seeds_give_equal_runs(scenes: dict[str, Scene]) -> None:
    place = scenes["logistics"]
    for make in EXECUTORS.values():
        one, other = (
            run(place, Planner(place), make, KINDS["everything"], seed=3) for _ in range(2)
        )
        assert (one.claimed, one.true, one.actions, one.plans) == (
            other.claimed,
            other.true,
            other.actions,
            other.plans,
        )


def test_impossible_action_fails_at_once(scenes: dict[str, Scene]) -> None:
    robot = robot_in(scenes["gripper"])
    assert robot.start(step(robot.scene, "put robot left red hall")).state is RunState.FAILED


def test_lasting_effects_end_with_the_behaviour(scenes: dict[str, Scene]) -> None:
    robot = robot_in(scenes["follow"])
    camera = robot.start(step(robot.scene, "stream eye eye-image rover"))
    robot.moment()
    assert {"flowing eye-image"} == robot.facts - robot.bare_facts
    assert "free eye-image" not in robot.facts
    camera.halt()
    assert robot.facts == robot.bare_facts


def test_goal_does_not_hold_where_a_behaviour_lacks_what_it_needs(
    scenes: dict[str, Scene],
) -> None:
    robot = robot_in(scenes["follow"])
    camera: SimulatedAction | None = None
    for name in (
        "localise crystal cobalt rover",
        "point head cobalt rover",
        "stream eye eye-image rover",
        "detect hog eye-image found rover person",
        "watch tracker found rover person",
        "report voice person rover",
        "track tracker found steering rover person",
        "drive wheels steering rover person",
    ):
        started = robot.start(step(robot.scene, name))
        camera = started if name.startswith("stream") else camera
        robot.moment()
    assert robot.goal_holds
    assert camera is not None
    camera.halt()
    assert "following rover person" in robot.facts  # no condition has noticed yet
    assert not robot.goal_holds
    for _ in range(3):
        robot.moment()
    assert "following rover person" not in robot.facts


def test_lost_units_come_back(scenes: dict[str, Scene]) -> None:
    robot = robot_in(scenes["rovers"], Troubles(losses=1.0))
    robot.moment()
    lost = robot.scene.start - robot.facts
    assert len(lost) == 1
    assert all(fact.startswith("ready ") for fact in lost)
    robot.troubles = CALM
    for _ in range(8):
        robot.moment()
    assert robot.facts == robot.scene.start


# PA-BT


def test_subtree_moves_left_of_what_it_would_break(scenes: dict[str, Scene]) -> None:
    robot = robot_in(scenes["gripper"])
    left, right = (Check(robot, frozenset({fact})) for fact in ("at a", "held b"))
    grown = Selector("held b", memory=False, children=[right])
    tree = Sequence("goal", memory=False, children=[left, grown])
    settle(grown, frozenset({"at a"}))
    assert [holds_for(node) for node in tree.children] == [{"held b"}, {"at a"}]


def test_subtree_that_it_is_part_of_moves_as_well(scenes: dict[str, Scene]) -> None:
    robot = robot_in(scenes["gripper"])
    threatened, outer, inner = (
        Check(robot, frozenset({fact})) for fact in ("at a", "in b y", "at y")
    )
    grown = Selector("at y", memory=False, children=[inner])
    way = Sequence("put", memory=False, children=[grown])
    part = Selector("in b y", memory=False, children=[outer, way])
    tree = Sequence("goal", memory=False, children=[threatened, part])
    settle(grown, frozenset({"at a"}))
    assert [holds_for(node) for node in tree.children] == [{"in b y"}, {"at a"}]


# The page


def outcome(*, claimed: bool = True, true: bool = True, actions: int = 10) -> Outcome:
    return Outcome(claimed, true, actions, 1, 10, (1.0, 2.0, 30.0))


def test_figures_count_what_runs_came_to() -> None:
    found = figures([outcome(), outcome(true=False, actions=30), outcome(claimed=False)])
    assert (found.runs, found.reached, found.false, found.stuck) == (3, 1, 1, 1)
    assert found.actions == pytest.approx(5 / 3)
    assert (found.tick_us, found.slow_us) == (2.0, 30.0)


def test_page_has_a_row_for_each_executor_in_each_scene() -> None:
    found = Results(
        tuple(
            Cell(name, trouble, executor, (outcome(true=executor == "nondum"),))
            for name in NAMES
            for trouble in KINDS
            for executor in EXECUTORS
        )
    )
    ticks = {way: dict.fromkeys(ticking.LENGTHS, Spread((1.0, 2.0))) for way in ticking.WAYS}
    text = report.as_markdown(found, ticks, seeds=1)
    rows = [line for line in text.splitlines() if line.startswith("| follow (10 steps) | ")]
    assert [row.split(" | ")[1] for row in rows] == list(EXECUTORS)
    words = " ".join(text.split())
    assert "**nondum** reached the goal in 35 of 35 runs, claimed so falsely in 0" in words
    assert "**PA-BT** reached the goal in 0 of 35 runs, claimed so falsely in 35" in words


def test_executors_meet_the_same_fates() -> None:
    found = cells("follow", seeds=2)
    assert [(cell.trouble, cell.executor) for cell in found] == [
        (trouble, executor) for trouble in KINDS for executor in EXECUTORS
    ]
    assert {len(cell.outcomes) for cell in found} == {2}


@pytest.mark.parametrize("way", ticking.WAYS)
def test_measured_trees_go_on_for_ever(way: str) -> None:
    tick = ticking.WAYS[way](10)
    for _ in range(20):
        tick()
