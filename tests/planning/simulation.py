"""A small world to run task trees in: behaviours take time, fail, lie, die, and are pulled out."""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random

from tests.planning.tasks import search

from nondum.planning.execute.attempts import Patience
from nondum.planning.execute.plan_executive import Phase
from nondum.planning.execute.running import RunningLeaves, RunState
from nondum.planning.execute.step import Step
from nondum.planning.execute.task_tree import TaskTree
from nondum.planning.execute.world import WorldModel
from nondum.planning.merge.goal import GoalKind
from nondum.planning.pddl.facts import parts
from nondum.sdk.planner import GroundAction, GroundTask, Plan


@dataclass(frozen=True)
class Troubles:
    """What goes wrong, each as a chance: per action, or per moment."""

    silent: float = 0.0
    """A finishing action says SUCCESS and has done nothing."""
    fails: float = 0.0
    """An action ends in FAILURE."""
    dies: float = 0.0
    """A lasting behaviour ends by itself, per moment."""
    changes: float = 0.0
    """Somebody else makes something true or false, per moment."""
    losses: float = 0.0
    """A unit is unplugged for a while, per moment."""
    refuses: float = 0.0
    """An action has failed by the time that it is handed over."""


@dataclass
class SimulatedAction:
    """One started action of the simulated robot."""

    action: GroundAction
    takes: int
    state: RunState = RunState.STARTING
    reason: str = ""
    progress: str = ""

    def halt(self) -> None:
        if not self.state.has_ended:
            self.state = RunState.HALTED


@dataclass
class Robot:
    """The truth, and a world model that sees all of it. Implements `Runner`."""

    task: GroundTask
    lasting: frozenset[str]
    random: Random = field(default_factory=lambda: Random(0))
    troubles: Troubles = field(default_factory=Troubles)
    world: WorldModel = field(default_factory=WorldModel)
    running: list[SimulatedAction] = field(default_factory=list)
    started: list[str] = field(default_factory=list)
    lost: dict[str, int] = field(default_factory=dict)
    now_s: float = 0.0

    def __post_init__(self) -> None:
        objects = frozenset(o for fact in self.task.facts for o in parts(fact)[1])
        observed = frozenset(parts(fact)[0] for fact in self.task.facts)
        self.world.frame(objects=objects, observed=observed)
        for index in self.task.init:
            self.world.know(self.task.facts[index], "truth", 0.0)

    def words(self, numbers: frozenset[int]) -> frozenset[str]:
        return frozenset(self.task.facts[number] for number in numbers)

    @property
    def goal_holds(self) -> bool:
        return self.words(self.task.goal) <= self.world.facts

    def names(self, *states: RunState) -> set[str]:
        return {a.action.name for a in self.running if a.state in states}

    # Runner

    def start(self, step: Step) -> SimulatedAction:
        action = step.action
        alive = self.names(RunState.STARTING, RunState.ESTABLISHED)
        assert action.name not in alive, "started twice"
        assert self.words(action.precondition) <= self.world.facts, f"{action.name} cannot start"
        self.started.append(action.name)
        if self.troubles.refuses and self.random.random() < self.troubles.refuses:
            return SimulatedAction(action, takes=0, state=RunState.FAILED, reason="not now")
        running = SimulatedAction(action, takes=self.random.randint(1, 3))
        self.running.append(running)
        return running

    # Time

    def moment(self) -> None:
        """Let time pass: everything that runs gets on, and what may go wrong does."""
        self.now_s += 1.0
        self._trouble()
        for running in self.running:
            self._get_on(running)
        for running in [r for r in self.running if r.state.has_ended]:
            self.world.end(running.action.name)
            self.running.remove(running)

    def lose(self, unit: str, moments: int) -> None:
        """Unplug a unit: its facts and behaviours go at once."""
        self.lost[unit] = moments
        self.world.forget(f"ready {unit}", "truth", self.now_s)
        for running in self.running:
            if unit in running.action.arguments[:1]:
                self.end(running, RunState.GONE, "its component is gone")

    def end(self, running: SimulatedAction, state: RunState, reason: str = "") -> None:
        """End an action; what it lasts for is undone this instant."""
        running.state, running.reason = state, reason
        self.world.end(running.action.name)

    def _get_on(self, running: SimulatedAction) -> None:
        if running.state.has_ended:
            return
        action, chance = running.action, self.random.random()
        lasting = action.schema in self.lasting
        if running.state is RunState.ESTABLISHED:
            if chance < self.troubles.dies:
                self.end(running, RunState.FAILED, "it died")
            return
        running.takes -= 1
        if running.takes > 0:
            return
        if chance < self.troubles.fails:
            self.end(running, RunState.FAILED, "it went wrong")
        elif lasting:
            running.state = RunState.ESTABLISHED
            self.world.establish(
                action.name,
                "robot",
                add=self.words(action.add),
                delete=self.words(action.delete),
                at_s=self.now_s,
            )
        else:
            running.state = RunState.SUCCEEDED
            if chance >= self.troubles.fails + self.troubles.silent:
                self._apply(action)

    def _apply(self, action: GroundAction) -> None:
        if not self.words(action.precondition - action.delete) <= self.world.facts:
            return  # somebody changed the world under its feet: nothing comes of it
        for fact in self.words(action.delete - action.add):
            self.world.forget(fact, "truth", self.now_s)
        for fact in self.words(action.add):
            self.world.know(fact, "truth", self.now_s)

    def _trouble(self) -> None:
        for unit in list(self.lost):
            self.lost[unit] -= 1
            if not self.lost[unit]:
                del self.lost[unit]
                self.world.know(f"ready {unit}", "truth", self.now_s)
        if self.random.random() < self.troubles.changes:
            self._change()
        units = sorted(f.split(" ")[1] for f in self.world.facts if f.startswith("ready "))
        if units and self.random.random() < self.troubles.losses:
            self.lose(self.random.choice(units), self.random.randint(3, 8))

    def _change(self) -> None:
        """Somebody else carries out a finishing action that is possible, so nothing is lost."""
        base = self.world.bare_facts
        possible = [
            action
            for action in self.task.actions
            if action.schema not in self.lasting and self.words(action.precondition) <= base
        ]
        if possible:
            self._apply(self.random.choice(possible))


@dataclass
class Outcome:
    """How a run ended."""

    reached: bool
    false_success: bool
    started: int
    replans: int


def run(robot: Robot, *, kind: GoalKind = "achieve", moments: int = 400) -> Outcome:
    """Plan, tick and replan until the goal is reached, as a host would; check every tick."""
    tree: TaskTree | None = None
    replans = 0
    for _ in range(moments):
        if tree is None or tree.needs_replan:
            fresh = replanned(robot, tree, kind)
            replans += fresh is not None
            tree = fresh or tree
        if tree is not None:
            tree.tick_once()
            check_safety(robot, tree)
            if tree.control.phase is Phase.REACHED:
                return Outcome(True, not robot.goal_holds, len(robot.started), replans)
        robot.moment()
    return Outcome(False, False, len(robot.started), replans)


def replanned(robot: Robot, tree: TaskTree | None, kind: GoalKind) -> TaskTree | None:
    """Another tree from where the world is, without the actions that were given up."""
    number = {fact: index for index, fact in enumerate(robot.task.facts)}
    start = frozenset(number[fact] for fact in robot.world.bare_facts if fact in number)
    plan = search(robot.task, start)
    return None if plan is None else task_tree(robot, plan, kind=kind, after=tree)


def task_tree(
    robot: Robot,
    plan: Plan,
    *,
    kind: GoalKind = "achieve",
    after: TaskTree | None = None,
    exclusive: frozenset[str] = frozenset({"base", "ptu"}),
    patience: Patience | None = None,
    leaves: RunningLeaves | None = None,
) -> TaskTree:
    """The tree of a plan on this robot."""
    return TaskTree(
        robot.task,
        plan,
        lasting=robot.lasting,
        leaves=RunningLeaves(robot, lambda: robot.now_s) if leaves is None else leaves,
        kind=kind,
        sight=lambda: (robot.world, robot.now_s),
        exclusive=exclusive,
        runs=after.release() if after else (),
        patience=patience or Patience(settle_s=0.0),
    )


def check_safety(robot: Robot, tree: TaskTree) -> None:
    """What must be true after every tick, whatever happens."""
    ended = {name for name, run in tree.control.runs.items() if run.is_halting}
    for name, running in tree.control.runs.items():
        if not running.is_halting:
            assert running.step.guard <= robot.world.facts_without(ended), f"{name} has no footing"
    actors = [r.step.actor for r in tree.control.runs.values() if r.step.actor in ("base", "ptu")]
    assert len(actors) == len(set(actors)), f"two users of one actuator: {actors}"
