"""The first demonstration's stages: two cameras are followed, and instruments on serial lines."""

from __future__ import annotations

import json
import time
from typing import Any

from demo.fall import Fall
from demo.following import Reference
from demo.instruments import Instruments
from demo.kit import Kit
from demo.one_host import CAMERA, FIRST, FOLLOW, INITIAL, POINT, REFERENCE, SECOND, THIRD
from demo.pointing import read_log
from demo.scenario import Scenario, random_scenario
from demo.stage import Mark
from demo.stages import HOLD_S, withdraw
from tests.lab import demonstration as shown
from tests.lab.body import Body
from tests.lab.demonstration import FollowedStream
from tests.lab.lab import Lab
from tests.lab.robot import MachineRobot

ALONE = True
"""A behaviour halts within 2 s, which another machine's start beside it takes from it."""
SPEED = 0.1
"""Of the recording: an emulated processor finds people in an image a second or two."""
PLAYED = f'pace = "every-frame"\nspeed = {SPEED}\n'
SETTINGS = {
    CAMERA: PLAYED,
    SECOND[0]: PLAYED,
    "people-detector": "scale = 1.1\n",
    "visual-tracker": (
        f"turn_gain = {2.5 * SPEED}\ncoast_s = {1.5 / SPEED}\n"
        f"stop_s = {3.0 / SPEED}\ngive_up_s = {60.0 / SPEED}\n"
    ),
    "compton-camera": "timeout_s = 900.0\n",
}
"""Lines of plugins' settings."""
BRAKE_S, STAND_S = 4.0, 10.0
SEED = 7
"""Of source and mounts."""


def run(lab: Lab) -> str:
    """One host, never restarted; goals in words; each judged by what really moved."""
    kit = shown.kit(lab, (INITIAL, *FIRST, *SECOND, *THIRD), SETTINGS)
    robot = shown.robot(lab, kit, INITIAL)
    notes = _followed(robot, kit)
    robot.nondum("halt")
    withdraw(robot, *(kit.drives[name] for name in (*FIRST, *SECOND) if name != CAMERA))
    notes.append(_pointed(lab, robot, kit))
    return "; ".join(notes)


def _followed(robot: MachineRobot, kit: Kit) -> list[str]:
    """I, the camera pulled and put back, II, and how those went."""
    body = Body(robot.host, Reference.read(REFERENCE), SPEED)
    start_rad = body.until_still()
    for name in FIRST:
        robot.plug(kit.drives[name])
    robot.nondum("goal", FOLLOW)
    notes = [f"I: ahead in {_share(robot, body, start_rad):.0%} of images"]
    notes.append(_lost(robot, body, kit))
    for stage, name in (("put back", CAMERA), ("II", SECOND[0])):
        if name != CAMERA:
            withdraw(robot, kit.drives[CAMERA])
            robot.host.until_goal(FOLLOW, "suspended")
        start_rad = body.until_still()
        robot.plug(kit.drives[name])
        notes.append(f"{stage}: ahead in {_share(robot, body, start_rad):.0%}")
    return notes


def _share(robot: MachineRobot, body: Body, start_rad: float) -> float:
    robot.host.until_goal(FOLLOW, "holds")
    return body.until_following(FollowedStream(robot.host, "image"), start_rad)


def _lost(robot: MachineRobot, body: Body, kit: Kit) -> str:
    """The camera is pulled while the body turns: all that needs it goes down in one tick, the body
    stands, and the host says what is missing."""
    steps = robot.machine.until("all of the plan runs", lambda: _turning(robot, body))
    mark = Mark(robot)
    robot.pull(kit.drives[CAMERA].name)
    robot.host.until_goal(FOLLOW, "suspended")
    moved = body.moved(body.now_s() + BRAKE_S, STAND_S)
    assert moved.is_still, f"the body went on: {moved}"
    fall = Fall.of(mark.journal())
    first = next(n for n, step in enumerate(steps) if step["component"] == CAMERA)
    others = {step["component"] for step in steps} - {CAMERA}
    halted = {end.component for end in fall.endings if end.outcome == "HALTED"}
    faults = [*fall.faults([step["action"] for step in steps[first:]], ())]
    faults += [f"{name} was not halted" for name in others - halted]
    faults += [f"the worker of {name} ended" for name in others & {*fall.exits}]
    assert not faults, "; ".join(faults)
    said = robot.nondum("why", FOLLOW)
    assert CAMERA in said, said
    return f"pulled: {len(steps) - first} behaviours down in one tick, then {moved}"


def _turning(robot: MachineRobot, body: Body) -> list[dict[str, Any]] | None:
    """The steps of the plan, if all of them run while the body turns: a machine that is emulated by
    busy processors may lose the flow of images for a moment."""
    body.until_turning()
    steps: list[dict[str, Any]] = json.loads(robot.nondum("plan", "--json"))["steps"]
    return steps if {step["state"] for step in steps} == {"established"} else None


def _pointed(lab: Lab, robot: MachineRobot, kit: Kit) -> str:
    """III: by the emulated instruments, of which the robot knows but what they say on their lines
    and where a person says that they are mounted."""
    scenario, machine = random_scenario(SEED), robot.machine
    for name in THIRD:
        robot.plug(kit.drives[name])
    with shown.instruments(robot.host, scenario, lab.work / "truth") as switched:
        lines = shown.plug(robot.host, switched)
        _mount(robot, scenario)
        robot.nondum("goal", POINT)
        robot.host.until_goal(POINT, "holds")
        score = switched.score(time.monotonic() + HOLD_S)
        assert score.is_reached, str(score)
        robot.nondum("halt")
        machine.until("the laser off", lambda: None if _is_lit(switched) else True)
        for line in lines:
            machine.pull_line(line)
    withdraw(robot, *(kit.drives[name] for name in THIRD))
    return f"III: {score}"


def _mount(robot: MachineRobot, scenario: Scenario) -> None:
    units = json.loads(robot.nondum("units", "--json"))
    for kind, mount in (("sensor", scenario.camera), ("pointer", scenario.pointer)):
        (unit,) = [row["unit"] for row in units if row["type"] == kind]
        where = ("--xyz", *map(str, mount.xyz), "--rpy", *map(str, mount.rpy))
        robot.nondum("mount", unit, *where)


def _is_lit(switched: Instruments) -> bool:
    return read_log(switched.log)[-1].laser
