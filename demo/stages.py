"""What a person does between following and pointing, and the stage of pointing."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from pathlib import Path

from demo.instruments import switched_on
from demo.pointing import TOLERANCE_RAD as POINTING_RAD
from demo.robot import Robot, View
from demo.scenario import Scenario
from demo.stage import INSTALL_S, Stage, only_unit
from demo.table import StageResult

POINT_S = 120.0
HOLD_S = 2.0
"""The laser must rest on the source so long before it is judged."""


def point(
    robot: Robot,
    drives: Mapping[str, Path],
    scenario: Scenario,
    *,
    name: str,
    words: str,
    published_s: float,
    mistold_rad: float = 0.0,
) -> StageResult:
    """Plug drives and instruments in, tell where they are mounted, and ask for the laser.

    `mistold_rad` is a person's mistake in the yaw that they tell of the pointer's mount.
    """
    stage = Stage(robot, name, words, published_s)
    for drive in drives.values():
        robot.plug(drive)
    with switched_on(scenario, robot.work) as instruments:
        instruments.plug(robot.devices)
        stage.installed(tuple(drives))
        roll, pitch, yaw = scenario.pointer.rpy
        told_rpy = {"sensor": scenario.camera.rpy, "pointer": (roll, pitch, yaw + mistold_rad)}
        for kind, mount in (("sensor", scenario.camera), ("pointer", scenario.pointer)):
            robot.ask("mount", unit=only_unit(robot, kind), xyz=mount.xyz, rpy=told_rpy[kind])
        robot.ask("goal", words=words)
        stage.planned()
        robot.until(f"{name}: every step established", _all_hold, timeout_s=POINT_S)
        stage.phase("goal")
        score = instruments.score(time.monotonic() + HOLD_S)
    measure = f"{score} (at most {math.degrees(POINTING_RAD):.0f}°)"
    return stage.result(reached=score.is_reached, measure=measure)


def withdraw(robot: Robot, *drives: Path) -> None:
    """Pull drives and wait until nothing of them is left."""
    for drive in drives:
        robot.pull(drive.name)
    names = {drive.name for drive in drives}
    robot.until(
        "pulled drives withdrawn",
        lambda view: not robot.payloads_on(names, view),
        timeout_s=INSTALL_S,
    )


def _all_hold(view: View) -> bool:
    """Whether every step of the plan is done or established."""
    states = [step["state"] for step in view["plan"]["steps"]]
    return bool(states) and all(state in ("done", "established") for state in states)
