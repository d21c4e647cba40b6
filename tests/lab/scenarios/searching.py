"""Two robots search with the parts of a compute node, and one is steered by it until it is lost."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from functools import partial

from demo import stages
from demo.drives import Target
from demo.robot import View
from demo.search import losing
from demo.search.person import Person
from demo.search.searching import ALERT, Search
from demo.search.three_hosts import (
    BASE,
    CAMERA,
    FOLLOW,
    FOR_NODE,
    NODE,
    OTHER_SENTENCES,
    ROBOT,
    SETTINGS,
    SMALL,
    search_kit,
)
from demo.stage import PLAN_S, Stage
from tests.lab.lab import Lab
from tests.lab.recipe import ARCHITECTURES, X86_64
from tests.lab.robot import MachineRobot

MUCH = 10_000
"""Rows: all of a journal."""
ALONE = True
"""Three machines are as many as two processors can emulate."""
SPEED = 0.1
"""Of the recording: an emulated processor needs a second or two to make an image, and as long to
find people in it; faster, the first image that differs would come so late that the stream counts as
stalled (see `nondum.sdk.pace`)."""
SLOW = {
    CAMERA: f'pace = "every-frame"\nspeed = {SPEED}\n',
    "people-detector": "scale = 1.1\n",
    "visual-tracker": (
        f"turn_gain = {2.5 * SPEED}\ncoast_s = {1.5 / SPEED}\n"
        f"stop_s = {3.0 / SPEED}\ngive_up_s = {60.0 / SPEED}\n"
    ),
}
"""Lines of plugins' settings."""


def run(lab: Lab) -> str:
    """The second demonstration, with sticks, kernels and cables; its times are an emulation's. The
    small robot is of the run's architecture, with 2 GB as the others."""
    kit = search_kit(
        lab.work / "sources",
        target=Target((lab.built.recipe.python,), tuple(ARCHITECTURES)),
        settings={**SETTINGS, **SLOW},
    )
    person = Person(lab.work / "person", expects=(ALERT, *OTHER_SENTENCES))
    payloads = {kit.drives[name].name: id for name, id in kit.payloads.items()}
    others = dict.fromkeys((ROBOT, NODE), X86_64.architecture)
    hosts = lab.fleet(ROBOT, NODE, SMALL, memory_mb=2048, of=others)
    robots = {name: MachineRobot(host, payloads) for name, host in hosts.items()}
    node, robot, small = robots[NODE], robots[ROBOT], robots[SMALL]
    for one in robots.values():
        threading.Thread(target=one.watch, daemon=True).start()
        one.until("the first view", bool, timeout_s=PLAN_S)
        one.trust(kit.trust)
    for one in (robot, small):
        one.install(kit.drives[BASE])

    search = Search(node, person)
    stage = search.begin(robot, published_s=0.0, begun_s=time.monotonic())
    search.equip(stage, {node: kit.of(FOR_NODE), robot: kit.of([CAMERA])})
    _reached(search, stage)

    stage = search.begin(small, published_s=0.0, begun_s=time.monotonic())
    stages.withdraw(robot, kit.drives[CAMERA])
    search.equip(stage, {small: kit.of([CAMERA])})
    _reached(search, stage)

    _follow(small)
    said = _lose(node, small, robots)
    return f"{ROBOT} and {SMALL} searched, {SMALL} was steered; {NODE} cut off: “{said}”"


def _reached(search: Search, stage: Stage) -> None:
    result = search.run(stage)
    assert result.reached, result.measure


def _follow(robot: MachineRobot) -> None:
    """Ask to be followed, and wait until every step of the plan is at work."""
    robot.nondum("goal", FOLLOW)
    robot.until("every step at work", _all_work, timeout_s=PLAN_S)


def _lose(node: MachineRobot, robot: MachineRobot, robots: Mapping[str, MachineRobot]) -> str:
    """Cut the node's cable: all ends that robot and node did for each other, the others forget the
    node; answers what is said to be missing."""
    steps = robot.view["plan"]["steps"]
    theirs = {step["component"] for step in steps if (step["component"] or "").endswith(node.name)}
    assert theirs, f"nothing of {node.name} is in the plan: {steps}"
    node.machine.cut_cable()
    robot.until("the goal suspended", _suspended, timeout_s=PLAN_S)
    for one in robots.values():
        if one is not node:
            one.until(f"{one.name} forgets", losing.without(node.name), timeout_s=PLAN_S)
    for one in (robot, node):
        one.machine.until(f"nothing is done by {one.name}", partial(_does_nothing, one))
    said = losing.missing(robots[ROBOT])
    assert f"bring the host {node.name} back" in said, said
    return said


def _does_nothing(robot: MachineRobot) -> bool | None:
    """Whether all that was begun has ended, by its own journal."""
    rows = robot.ask("journal", limit=MUCH)
    begun, ended = (
        {row["detail"]["call_id"] for row in rows if row["event"] == event}
        for event in ("BehaviourStarted", "BehaviourEnded")
    )
    return True if begun <= ended else None


def _all_work(view: View) -> bool:
    """Whether every step of the plan is done or established; none of those has no component."""
    states = [step["state"] for step in view["plan"]["steps"]]
    return bool(states) and all(state in ("done", "established") for state in states)


def _suspended(view: View) -> View | None:
    return next((row for row in view["goals"] if row["state"] == "suspended"), None)
