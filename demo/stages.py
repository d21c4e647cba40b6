"""The three stages, each a sequence of what a person does and what must then be seen."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from demo.following import TOLERANCE_RAD, WANTED_FRACTION, WINDOW_S, Reference, score_following
from demo.instruments import switched_on
from demo.listening import Heard, listening
from demo.pointing import TOLERANCE_RAD as POINTING_RAD
from demo.robot import Robot, TooLate, View
from demo.scenario import Scenario
from demo.table import StageResult

INSTALL_S = 60.0
PLAN_S = 20.0
FOLLOW_S = 60.0
POINT_S = 120.0
STANDING_S = 0.5
STANDING_RAD = math.radians(0.2)
HOLD_S = 2.0
"""The laser must rest on the source so long before it is judged."""


@dataclass
class Stage:
    """What has been seen of one stage so far."""

    robot: Robot
    name: str
    goal: str
    published_s: float
    begun_s: float = field(default_factory=time.monotonic)
    phases_s: dict[str, float] = field(default_factory=dict)
    plan: tuple[str, ...] = ()

    def phase(self, name: str, at_s: float | None = None) -> None:
        """A phase is complete."""
        self.phases_s[name] = (time.monotonic() if at_s is None else at_s) - self.begun_s

    def installed(self, payloads: Sequence[str]) -> None:
        """Wait until all payloads are active, and take their phases over from the host."""

        def active(view: View) -> Mapping[str, View] | None:
            found = {p["payload"]: p for p in view["payloads"] if p["payload"] in payloads}
            refused = [line for p in found.values() for line in p["problems"]]
            if refused:
                raise TooLate("\n".join(refused))
            is_all = len(found) == len(payloads)
            return found if is_all and all(p["state"] == "active" for p in found.values()) else None

        found = self.robot.until(f"{self.name}: payloads active", active, timeout_s=INSTALL_S)
        for phase in ("seen", "verified", "installed", "ready"):
            self.phase(phase, max(p["phases"][phase] for p in found.values()))

    def planned(self) -> None:
        """Wait until there is a plan."""

        def steps(view: View) -> tuple[str, ...] | None:
            return tuple(step["action"] for step in view["plan"]["steps"]) or None

        self.plan = self.robot.until(f"{self.name}: a plan", steps, timeout_s=PLAN_S)
        self.phase("in plan")

    def result(self, *, reached: bool, measure: str, told: Sequence[str]) -> StageResult:
        """What the table shows."""
        return StageResult(
            name=self.name,
            goal=self.goal,
            phases_s=self.phases_s,
            published_s=self.published_s,
            reached=reached,
            measure=measure,
            plan=self.plan,
            told=told,
        )


def follow(
    robot: Robot,
    drives: Mapping[str, Path],
    reference: Reference,
    *,
    name: str,
    words: str,
    published_s: float,
    is_given: bool = False,
) -> StageResult:
    """Plug drives in, ask to be followed, and measure whether the robot does.

    `is_given`: the goal was given before and waits for what the drives bring.
    """
    before = robot.told_number()
    with listening(robot.control, _stream(robot, "pose")) as body:
        # The recording hangs where the body looks when the stream begins: it stands until then.
        start_rad = _standing(body)
        stage = Stage(robot, name, words, published_s)
        for drive in drives.values():
            robot.plug(drive)
        stage.installed(tuple(drives))
        with listening(robot.control, _stream(robot, "image")) as camera:
            if not is_given:
                robot.ask("goal", words=words)
            stage.planned()
            share = _followed(body, camera, reference, start_rad, stage)
    measure = (
        f"the person within ±{math.degrees(TOLERANCE_RAD):.0f}° of the heading in {share:.0%} of "
        f"frames over {WINDOW_S:.0f} s (at least {WANTED_FRACTION:.0%})"
    )
    said = robot.told_since(before)
    return stage.result(reached=share >= WANTED_FRACTION, measure=measure, told=said)


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
    before = robot.told_number()
    stage = Stage(robot, name, words, published_s)
    for drive in drives.values():
        robot.plug(drive)
    with switched_on(scenario, robot.work) as instruments:
        instruments.plug(robot.devices)
        stage.installed(tuple(drives))
        roll, pitch, yaw = scenario.pointer.rpy
        told_rpy = {"sensor": scenario.camera.rpy, "pointer": (roll, pitch, yaw + mistold_rad)}
        for kind, mount in (("sensor", scenario.camera), ("pointer", scenario.pointer)):
            robot.ask("mount", unit=_unit(robot, kind), xyz=mount.xyz, rpy=told_rpy[kind])
        robot.ask("goal", words=words)
        stage.planned()
        robot.until(f"{name}: every step established", _all_hold, timeout_s=POINT_S)
        stage.phase("goal")
        score = instruments.score(time.monotonic() + HOLD_S)
    measure = f"{score} (at most {math.degrees(POINTING_RAD):.0f}°)"
    return stage.result(reached=score.is_reached, measure=measure, told=robot.told_since(before))


def withdraw(robot: Robot, *drives: Path) -> None:
    """Pull drives and wait until nothing of them is left."""
    for drive in drives:
        robot.pull(drive.name)
    names = {drive.name for drive in drives}
    robot.until(
        "pulled drives withdrawn",
        lambda view: not any(names & set(p["drive"].split(", ")) for p in view["payloads"]),
        timeout_s=INSTALL_S,
    )


def _standing(body: Heard) -> float:
    """The heading, once the body has not turned for `STANDING_S`. Raises `TooLate`."""
    pause, deadline = threading.Event(), time.monotonic() + PLAN_S
    while time.monotonic() < deadline:
        headings = tuple(body.headings)
        recent = [yaw for stamp, yaw in headings if stamp > headings[-1][0] - STANDING_S]
        is_long = bool(headings) and headings[-1][0] - headings[0][0] > STANDING_S
        if is_long and max(recent) - min(recent) < STANDING_RAD:
            return recent[-1]
        pause.wait(0.1)
    raise TooLate("the body does not stand still, or tells no heading")


def _followed(
    body: Heard, camera: Heard, reference: Reference, start_rad: float, stage: Stage
) -> float:
    """The best share of frames with the person ahead, over any window until the deadline."""
    best, deadline = 0.0, time.monotonic() + FOLLOW_S
    pause = threading.Event()
    while time.monotonic() < deadline:
        frames = tuple(camera.frames)
        if not frames:
            pause.wait(0.25)
            continue
        headings = tuple(body.headings)
        share = score_following(headings, frames, reference, start_rad=start_rad)
        best = max(best, share)
        if share >= WANTED_FRACTION:
            stage.phase("goal")
            return share
        pause.wait(0.25)
    return best


def _stream(robot: Robot, kind: str) -> str:
    """The only stream of a type that the robot has."""
    found = [stream["stream"] for stream in robot.view["streams"] if stream["type"] == kind]
    if len(found) != 1:
        raise TooLate(f"expected one stream of type {kind}, found {found}")
    return str(found[0])


def _unit(robot: Robot, kind: str) -> str:
    """The only unit of a type that the robot has."""
    found = [row["unit"] for row in robot.ask("units") if row["type"] == kind]
    if len(found) != 1:
        raise TooLate(f"expected one unit of type {kind}, found {found}")
    return str(found[0])


def _all_hold(view: View) -> bool:
    """Whether every step of the plan is done or established."""
    states = [step["state"] for step in view["plan"]["steps"]]
    return bool(states) and all(state in ("done", "established") for state in states)
