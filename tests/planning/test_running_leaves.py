"""Behaviours run only while their leaves are ticked."""

from __future__ import annotations

from random import Random

from tests.planning.simulation import Robot, task_tree
from tests.planning.tasks import FOLLOW_LASTING, FOLLOW_PLAN, follow_task, plan_of

from nondum.planning.execute.running import LEASE_S, RunningLeaves, RunState
from nondum.planning.execute.step import Step, steps_of


def first_step(robot: Robot) -> Step:
    plan = plan_of(robot.task, *FOLLOW_PLAN)
    return steps_of(robot.task, plan, robot.lasting)[0]


def test_behaviour_of_a_ticked_leaf_runs_on() -> None:
    robot = Robot(follow_task(), FOLLOW_LASTING, Random(0))
    leaves, step = RunningLeaves(robot, lambda: robot.now_s), first_step(robot)
    action = leaves.start(step)
    for _ in range(10):
        robot.now_s += LEASE_S
        leaves.tick(step, action)
        assert leaves.expire() == ()
    assert not action.state.has_ended


def test_behaviour_of_a_leaf_that_is_no_longer_ticked_is_halted_once() -> None:
    robot = Robot(follow_task(), FOLLOW_LASTING, Random(0))
    leaves, step = RunningLeaves(robot, lambda: robot.now_s), first_step(robot)
    action = leaves.start(step)
    robot.now_s += LEASE_S
    assert leaves.expire() == ()
    robot.now_s += 0.1
    assert leaves.expire() == (step,)
    assert action.state is RunState.HALTED
    assert leaves.expire() == ()
    assert len(leaves) == 0


def test_behaviour_that_has_ended_is_not_counted() -> None:
    robot = Robot(follow_task(), FOLLOW_LASTING, Random(0))
    leaves, step = RunningLeaves(robot, lambda: robot.now_s), first_step(robot)
    robot.end(leaves.start(step), RunState.FAILED)  # type: ignore[arg-type]  # the robot's own
    assert len(leaves) == 1
    assert leaves.expire() == ()
    assert len(leaves) == 0


def test_tree_that_is_no_longer_ticked_runs_nothing() -> None:
    robot = Robot(follow_task(), FOLLOW_LASTING, Random(0))
    plan = plan_of(robot.task, *FOLLOW_PLAN)
    leaves = RunningLeaves(robot, lambda: robot.now_s)
    tree = task_tree(robot, plan, kind="maintain", leaves=leaves)
    for _ in range(20):
        tree.tick_once()
        robot.moment()
    running = robot.names(RunState.STARTING, RunState.ESTABLISHED)
    assert running
    robot.now_s += LEASE_S + 1.0
    assert {step.name for step in leaves.expire()} == running
    assert not robot.names(RunState.STARTING, RunState.ESTABLISHED)
