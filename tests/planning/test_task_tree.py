"""Task trees on a simulated robot: what is started, kept, halted and done again."""

from __future__ import annotations

from random import Random

import pytest
from py_trees.common import Status
from tests.kit.golden import Golden
from tests.planning.simulation import Robot, Troubles, check_safety, run, task_tree
from tests.planning.tasks import (
    FOLLOW_LASTING,
    FOLLOW_PLAN,
    Written,
    delivery_task,
    follow_task,
    gripper_task,
    ground,
    plan_of,
    search,
    survey_task,
)

from nondum.planning.execute.attempts import Patience
from nondum.planning.execute.plan_executive import Phase
from nondum.planning.execute.running import RunningLeaves, RunState
from nondum.planning.execute.task_tree import StepLeaf, TaskTree
from nondum.sdk.planner import GroundTask

CAMERA, DETECT, TRACK, DRIVE = FOLLOW_PLAN
TASKS = {
    "follow": follow_task,
    "survey": survey_task,
    "gripper": gripper_task,
    "delivery": delivery_task,
}
TROUBLES = {
    "silent failures": Troubles(silent=0.2),
    "failures": Troubles(fails=0.15),
    "deaths": Troubles(dies=0.05),
    "outside changes": Troubles(changes=0.1),
    "component loss": Troubles(losses=0.05),
    "refusals": Troubles(refuses=0.15),
    "everything": Troubles(0.1, 0.05, 0.02, 0.05, 0.02),
}


def let_pass(robot: Robot, tree: TaskTree, moments: int = 20) -> None:
    for _ in range(moments):
        tree.tick_once()
        check_safety(robot, tree)
        robot.moment()
    tree.tick_once()


def following(kind: str = "maintain") -> tuple[Robot, TaskTree]:
    """A robot that follows, its whole chain established."""
    robot = Robot(follow_task(), FOLLOW_LASTING)
    tree = task_tree(robot, plan_of(robot.task, *FOLLOW_PLAN), kind=kind)  # type: ignore[arg-type]  # a test's literal
    if kind == "maintain":
        let_pass(robot, tree)
        assert robot.names(RunState.ESTABLISHED) == set(FOLLOW_PLAN)
    return robot, tree


@pytest.mark.parametrize("trouble", TROUBLES)
@pytest.mark.parametrize("name", TASKS)
def test_goals_are_reached_in_spite_of(name: str, trouble: str) -> None:
    for seed in range(15):
        robot = Robot(TASKS[name](), FOLLOW_LASTING, Random(seed), TROUBLES[trouble])
        outcome = run(robot)
        assert outcome.reached, f"seed {seed}"
        assert not outcome.false_success, f"seed {seed}"


def test_no_trouble_takes_each_step_once() -> None:
    for name, make in TASKS.items():
        robot = Robot(make(), FOLLOW_LASTING)
        plan = search(robot.task, robot.task.init)
        assert plan is not None
        outcome = run(robot)
        assert (outcome.reached, outcome.started, outcome.replans) == (True, len(plan.steps), 1), (
            name
        )


def test_achieve_halts_everything_on_success() -> None:
    robot, tree = following("achieve")
    let_pass(robot, tree)
    assert tree.status is Status.SUCCESS
    assert not robot.running


def test_maintain_keeps_what_the_goal_needs() -> None:
    robot, tree = following()
    assert tree.status is Status.RUNNING
    assert tree.control.phase is Phase.HOLDING
    assert robot.goal_holds


def test_pulled_camera_takes_the_chain_down_in_one_tick() -> None:
    robot, tree = following()
    robot.lose("cam", moments=1000)
    tree.tick_once()
    assert not [run for run in tree.control.runs.values() if not run.is_halting]
    robot.moment()
    tree.tick_once()
    assert not robot.running
    assert tree.status is Status.FAILURE
    assert tree.needs_replan == f"(ready cam) does not hold, which {CAMERA} needs"


def test_chain_comes_back_with_its_camera() -> None:
    robot, tree = following()
    robot.lose("cam", moments=5)
    let_pass(robot, tree, 30)
    assert tree.control.phase is Phase.HOLDING
    assert robot.started == [*FOLLOW_PLAN, *FOLLOW_PLAN]


def test_only_what_died_is_started_again() -> None:
    robot, tree = following()
    tracker = next(r for r in robot.running if r.action.name == TRACK)
    robot.end(tracker, RunState.FAILED, "it died")
    let_pass(robot, tree)
    assert tree.control.phase is Phase.HOLDING
    assert robot.started == [*FOLLOW_PLAN, TRACK, DRIVE]


def test_stalled_stream_is_started_again_after_patience() -> None:
    robot, tree = following()
    tree.control.attempts.patience = Patience(settle_s=2.0)
    robot.world.forget("flowing cam-img", "cam", robot.now_s)
    tree.tick_once()
    assert CAMERA in robot.names(RunState.ESTABLISHED)
    let_pass(robot, tree)
    assert robot.started == [*FOLLOW_PLAN, *FOLLOW_PLAN]
    assert tree.control.phase is Phase.HOLDING


def test_lasting_step_is_halted_when_nothing_needs_it() -> None:
    robot = Robot(survey_task(), FOLLOW_LASTING)
    plan = search(robot.task, robot.task.init)
    assert plan is not None
    tree = task_tree(robot, plan, kind="maintain")
    let_pass(robot, tree)
    assert robot.goal_holds
    assert robot.names(RunState.ESTABLISHED) == {"ptu.point ptu src r"}


def test_independent_steps_run_side_by_side() -> None:
    robot = Robot(survey_task(), FOLLOW_LASTING)
    plan = search(robot.task, robot.task.init)
    assert plan is not None
    tree = task_tree(robot, plan)
    tree.tick_once()
    assert set(robot.started) == {CAMERA, "rad.localise rad src r"}


def test_achieved_steps_are_skipped() -> None:
    robot = Robot(gripper_task(1), frozenset())
    plan = plan_of(robot.task, "pick ball0 a", "move a b", "drop ball0 b")
    robot.world.forget("in ball0 a", "truth", 0.0)
    robot.world.forget("empty", "truth", 0.0)
    robot.world.know("held ball0", "truth", 0.0)
    let_pass(robot, task_tree(robot, plan))
    assert robot.started == ["move a b", "drop ball0 b"]


def hang(robot: Robot, tree: TaskTree, moments: int) -> None:
    """Let time pass in which nothing that was started comes to anything."""
    for _ in range(moments):
        tree.tick_once()
        for running in robot.running:
            running.takes = 1000
        robot.moment()
    tree.tick_once()


@pytest.mark.parametrize(
    ("lasting", "key"), [(FOLLOW_LASTING, "establish_s"), (frozenset[str](), "finish_s")]
)
def test_behaviour_that_comes_to_nothing_has_failed(lasting: frozenset[str], key: str) -> None:
    robot = Robot(follow_task(), lasting)
    patience = Patience(settle_s=0.0, establish_s=5.0, finish_s=5.0)
    tree = task_tree(robot, plan_of(robot.task, *FOLLOW_PLAN), patience=patience)
    hang(robot, tree, 4)
    assert tree.control.phase is Phase.UNDER_WAY
    hang(robot, tree, 30)
    assert robot.started == [CAMERA] * 3
    assert tree.control.exhausted == (CAMERA,)
    assert tree.needs_replan is not None
    assert "BEHAVIOUR_OVERDUE" in tree.needs_replan
    assert f"raise planning.{key}" in tree.needs_replan


def test_behaviour_that_gets_on_is_waited_for() -> None:
    robot = Robot(follow_task(), FOLLOW_LASTING)
    patience = Patience(settle_s=0.0, establish_s=5.0)
    tree = task_tree(robot, plan_of(robot.task, *FOLLOW_PLAN), patience=patience)
    hang(robot, tree, 4)
    for percent in range(10):
        robot.running[0].progress = f"{percent} %"
        hang(robot, tree, 4)
    assert robot.started == [CAMERA]
    assert tree.control.phase is Phase.UNDER_WAY


def test_failing_action_is_given_up_after_its_attempts(golden: Golden) -> None:
    robot = Robot(gripper_task(1), frozenset(), troubles=Troubles(fails=1.0))
    tree = task_tree(robot, plan_of(robot.task, "pick ball0 a", "move a b", "drop ball0 b"))
    let_pass(robot, tree, 30)
    assert tree.status is Status.FAILURE
    assert tree.control.exhausted == ("pick ball0 a",)
    golden.check("an action failed too often", tree.needs_replan or "")
    assert robot.started == ["pick ball0 a"] * 3


def test_only_a_lasting_action_holds_for_a_while() -> None:
    """Else what a finishing one has failed before would be forgotten as it is tried again."""
    robot = Robot(gripper_task(1), frozenset())
    tree = task_tree(robot, plan_of(robot.task, "pick ball0 a", "move a b", "drop ball0 b"))
    tree.tick_once()
    assert tree.control.runs.keys() == {"pick ball0 a"}
    assert tree.control.proven(robot.now_s + 3600) == ()
    robot, tree = following()
    assert set(tree.control.proven(robot.now_s + 3600)) == set(FOLLOW_PLAN)


def test_action_that_fails_as_it_is_started_is_tried_again_and_tells_why(golden: Golden) -> None:
    robot = Robot(gripper_task(1), frozenset(), troubles=Troubles(refuses=1.0))
    tree = task_tree(robot, plan_of(robot.task, "pick ball0 a", "move a b", "drop ball0 b"))
    tree.tick_once()
    assert (tree.control.phase, tree.needs_replan) == (Phase.UNDER_WAY, None)
    let_pass(robot, tree, 5)
    assert robot.started == ["pick ball0 a"] * 3
    golden.check("an action was refused too often", tree.needs_replan or "")


def test_effects_may_take_their_time_to_be_seen(golden: Golden) -> None:
    robot = Robot(gripper_task(1), frozenset(), troubles=Troubles(silent=1.0))
    tree = task_tree(
        robot,
        plan_of(robot.task, "pick ball0 a", "move a b", "drop ball0 b"),
        patience=Patience(settle_s=1000.0),
    )
    let_pass(robot, tree)
    assert robot.started == ["pick ball0 a"]
    assert tree.status is Status.RUNNING
    golden.check("effects are not seen yet", tree.steps[0].why())


def test_next_tree_takes_over_what_it_needs() -> None:
    robot, tree = following()
    names = list(FOLLOW_PLAN)
    after = task_tree(robot, plan_of(robot.task, *names), kind="maintain", after=tree)
    let_pass(robot, after)
    assert robot.started == list(FOLLOW_PLAN)
    assert after.control.phase is Phase.HOLDING


def test_next_tree_halts_what_stands_in_its_way() -> None:
    """Another camera feeds the same detector: the old chain gives its slots back first."""
    robot, tree = following()
    robot.lose("cam", moments=1000)
    other = (
        "cam.stream thermal thermal-img r",
        "det.detect det thermal-img det-dets r",
        TRACK,
        DRIVE,
    )
    after = task_tree(robot, plan_of(robot.task, *other), kind="maintain", after=tree)
    let_pass(robot, after, 30)
    assert after.control.phase is Phase.HOLDING
    assert robot.names(RunState.ESTABLISHED) == set(other)


def test_behaviour_of_a_component_that_went_away_has_not_failed() -> None:
    robot, tree = following()
    robot.lose("cam", moments=3)
    let_pass(robot, tree, moments=1)
    assert tree.control.past[CAMERA].state is RunState.GONE
    assert not tree.control.attempts.troubled()
    let_pass(robot, tree)
    assert robot.names(RunState.ESTABLISHED) == set(FOLLOW_PLAN), "it is started again"


def test_interruption_halts_everything() -> None:
    robot, tree = following()
    tree.stop(Status.INVALID)
    assert robot.names(RunState.HALTED) == set(FOLLOW_PLAN)


class LazyLeaf(StepLeaf):
    """A leaf that never starts its behaviour."""

    def initialise(self) -> None:
        pass


def test_plan_stalls_at_a_leaf_that_never_starts_its_behaviour() -> None:
    robot, tree = following("achieve")
    whole = tree.steps[1]
    lazy = LazyLeaf(tree.control, 1, RunningLeaves(robot, lambda: robot.now_s))
    tree.steps = (tree.steps[0], lazy, *tree.steps[2:])
    tree.replace_child(whole, lazy)
    let_pass(robot, tree)
    assert robot.started == [tree.steps[0].name]
    assert tree.control.phase is Phase.UNDER_WAY


def test_leaf_that_is_stopped_halts_its_behaviour() -> None:
    robot, tree = following()
    let_pass(robot, tree)
    leaf = tree.steps[-1]
    assert leaf.name in robot.names(RunState.ESTABLISHED)
    leaf.stop(Status.INVALID)
    assert leaf.name not in robot.names(RunState.STARTING, RunState.ESTABLISHED)


def test_behaviours_that_hold_each_other_up_fall() -> None:
    task = ground(
        [
            Written("l.left u", "seed, base-on", "p"),
            Written("l.right v", "p", "seed, q"),
        ],
        "seed, base-on",
        "q",
    )
    robot = Robot(task, frozenset({"l.left", "l.right"}))
    tree = task_tree(robot, plan_of(task, "l.left u", "l.right v"), kind="maintain")
    let_pass(robot, tree)
    assert robot.names(RunState.ESTABLISHED) == {"l.left u", "l.right v"}
    robot.world.forget("seed", "truth", robot.now_s)
    robot.world.know("seed", "stranger", robot.now_s)
    robot.world.remove_component("stranger", ())
    let_pass(robot, tree)
    assert not robot.running


def test_every_leaf_says_why(golden: Golden) -> None:
    robot, tree = following()
    *chain, last = (leaf.why() for leaf in tree.steps)
    for why, user in zip(chain, (DETECT, TRACK, DRIVE), strict=True):
        golden.check("a step runs for another", why, user=user)
    golden.check("a step runs for the goal", last)
    robot.lose("cam", moments=1000)
    tree.tick_once()
    golden.check("a camera is lost", tree.why())


def empty_task() -> GroundTask:
    return ground([Written("noop", "a", "b")], "a", "a")


def test_goal_that_holds_needs_no_step() -> None:
    robot = Robot(empty_task(), frozenset())
    tree = task_tree(robot, plan_of(robot.task))
    tree.tick_once()
    assert tree.status is Status.SUCCESS
