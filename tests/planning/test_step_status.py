"""Where each step of a task is, and why, through its whole life."""

from __future__ import annotations

from tests.kit.golden import Golden
from tests.planning.simulation import Robot, Troubles, task_tree
from tests.planning.tasks import (
    FOLLOW_LASTING,
    FOLLOW_PLAN,
    follow_task,
    gripper_task,
    plan_of,
    search,
    survey_task,
)

from nondum.planning.execute.partial_order import GOAL
from nondum.planning.execute.running import RunState
from nondum.planning.execute.step_status import StepState, StepStatus
from nondum.planning.execute.task_tree import StepLeaf, TaskTree

CARRY = ("pick ball0 a", "move a b", "drop ball0 b")


def where(tree: TaskTree) -> list[StepStatus]:
    return [leaf.where() for leaf in tree.steps]


def states(tree: TaskTree) -> str:
    return " ".join(one.state.value for one in where(tree))


def carrying(troubles: Troubles | None = None) -> tuple[Robot, TaskTree]:
    robot = Robot(gripper_task(1), frozenset(), troubles=troubles or Troubles())
    return robot, task_tree(robot, plan_of(robot.task, *CARRY))


def let_pass(robot: Robot, tree: TaskTree, until: str) -> None:
    for _ in range(50):
        tree.tick_once()
        if states(tree) == until:
            return
        robot.moment()
    raise AssertionError(f"never {until}: {states(tree)}")


def test_steps_wait_run_and_are_done() -> None:
    robot, tree = carrying()
    let_pass(robot, tree, "running waiting waiting")
    let_pass(robot, tree, "done running waiting")
    let_pass(robot, tree, "done done running")
    let_pass(robot, tree, "done done done")


def test_waiting_step_says_what_it_lacks_and_which_step_gives_it(golden: Golden) -> None:
    _, tree = carrying()
    tree.tick_once()
    _, move, drop = where(tree)
    assert move.after == (0,)
    assert [(link.fact, link.provider) for link in drop.lacks] == [("at b", 1), ("held ball0", 0)]
    golden.check("a step comes after another", drop.why)


def test_step_says_who_needs_it() -> None:
    _, tree = carrying()
    pick, _, drop = where(tree)
    assert [(link.fact, link.consumer) for link in pick.needed_by] == [("held ball0", 2)]
    assert [(link.fact, link.consumer) for link in drop.needed_by] == [("in ball0 b", GOAL)]


def test_step_says_when_it_ran() -> None:
    robot, tree = carrying()
    let_pass(robot, tree, "done running waiting")
    pick, move, drop = where(tree)
    assert (pick.started_s, pick.ended_s) == (0.0, robot.now_s)
    assert (move.started_s, move.ended_s) == (robot.now_s, None)
    assert (drop.started_s, drop.ended_s) == (None, None)


def test_achieved_step_that_never_ran_is_skipped() -> None:
    robot, tree = carrying()
    robot.world.forget("at a", "truth", 0.0)
    robot.world.know("at b", "truth", 0.0)
    robot.world.forget("in ball0 a", "truth", 0.0)
    robot.world.forget("empty", "truth", 0.0)
    robot.world.know("held ball0", "truth", 0.0)
    tree.tick_once()
    assert states(tree) == "skipped skipped running"


def test_step_that_keeps_failing_is_excluded(golden: Golden) -> None:
    robot, tree = carrying(Troubles(fails=1.0))
    let_pass(robot, tree, "excluded waiting waiting")
    golden.check("a step is excluded", where(tree)[0].why)


def test_chain_is_kept_for_its_users(golden: Golden) -> None:
    robot = Robot(follow_task(), FOLLOW_LASTING)
    tree = task_tree(robot, plan_of(robot.task, *FOLLOW_PLAN), kind="maintain")
    let_pass(robot, tree, "kept kept kept kept")
    camera, *_, drive = where(tree)
    golden.check("a step is kept for another", camera.why, user=FOLLOW_PLAN[1])
    assert camera.takes == ("free cam-img",)
    assert not camera.exclusive
    assert (drive.exclusive, drive.takes) == (True, ("idle base",))


def test_step_without_its_unit_is_halted_and_then_stuck(golden: Golden) -> None:
    robot = Robot(follow_task(), FOLLOW_LASTING)
    tree = task_tree(robot, plan_of(robot.task, *FOLLOW_PLAN), kind="maintain")
    let_pass(robot, tree, "kept kept kept kept")
    robot.world.forget("ready trk", "truth", robot.now_s)
    tree.tick_once()
    assert states(tree) == "kept kept halting halting"
    golden.check("a step is halting", where(tree)[2].why)
    robot.moment()
    tree.tick_once()
    assert states(tree) == "kept kept waiting waiting"
    golden.check("the plan is stuck", where(tree)[2].why)


def test_actuator_in_use_is_waited_for() -> None:
    robot = Robot(survey_task(), FOLLOW_LASTING)
    plan = search(robot.task, robot.task.init)
    assert plan is not None
    tree = task_tree(robot, plan, exclusive=frozenset({"cam"}))
    tree.tick_once()
    camera = next(leaf for leaf in tree.steps if leaf.name.startswith("cam.stream"))
    assert isinstance(camera, StepLeaf)
    assert camera.where().exclusive
    assert camera.where().state is StepState.RUNNING
    assert RunState.STARTING in {run.action.state for run in tree.control.runs.values()}
