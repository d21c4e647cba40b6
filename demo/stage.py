"""One stage while it runs: what a person has done in it, and what has been seen since."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from demo.robot import Robot, TooLate, View
from demo.table import StageResult

INSTALL_S = 60.0
PLAN_S = 20.0


class Mark:
    """A moment of a host: what it has told and done since."""

    def __init__(self, robot: Robot) -> None:
        """Now."""
        self._robot = robot
        self._told_before = robot.told_number()
        self._journalled_before = max((row["id"] for row in self._newest(limit=1)), default=0)

    def told(self) -> tuple[str, ...]:
        """What the host has told, oldest first."""
        return self._robot.told_since(self._told_before)

    def journal(self) -> list[View]:
        """What has happened, oldest first."""
        return [row for row in self._newest(limit=1000) if row["id"] > self._journalled_before]

    def _newest(self, *, limit: int) -> list[View]:
        return list(self._robot.ask("journal", limit=limit))


@dataclass
class Stage:
    """What has been seen of one stage so far."""

    robot: Robot
    name: str
    goal: str
    published_s: float | None = None
    begun_s: float = field(default_factory=time.monotonic)
    phases_s: dict[str, float] = field(default_factory=dict)
    plan: tuple[str, ...] = ()
    faults: list[str] = field(default_factory=list)
    """What was seen that must not be: the stage is not reached then, whatever is measured."""
    _mark: Mark = field(init=False)

    def __post_init__(self) -> None:
        self._mark = Mark(self.robot)

    def phase(self, name: str, at_s: float | None = None) -> None:
        """A phase is complete."""
        self.phases_s[name] = (time.monotonic() if at_s is None else at_s) - self.begun_s

    def installed(self, payloads: Sequence[str]) -> None:
        """Wait until all payloads are active, and take their phases over from the host."""
        found = until_active(self.robot, payloads, what=self.name)
        for phase in ("seen", "verified", "installed", "ready"):
            self.phase(phase, max(p["phases"][phase] for p in found))

    def planned(self) -> None:
        """Wait until there is a plan."""

        def steps(view: View) -> tuple[str, ...] | None:
            return tuple(step["action"] for step in view["plan"]["steps"]) or None

        self.plan = self.robot.until(f"{self.name}: a plan", steps, timeout_s=PLAN_S)
        self.phase("in plan")

    def told(self) -> tuple[str, ...]:
        """What the host has told since the stage began."""
        return self._mark.told()

    def journal(self) -> list[View]:
        """What has happened since the stage began, oldest first."""
        return self._mark.journal()

    def result(self, *, reached: bool, measure: str) -> StageResult:
        """What the table shows."""
        return StageResult(
            name=self.name,
            goal=self.goal,
            phases_s=self.phases_s,
            published_s=self.published_s,
            reached=reached and not self.faults,
            measure="; BUT ".join([measure, *self.faults]),
            plan=self.plan,
            told=self.told(),
        )


def until_active(robot: Robot, payloads: Sequence[str], *, what: str) -> Sequence[View]:
    """Wait until all payloads are active, and give their rows. Raises `TooLate`, also when one is
    refused."""

    def active(view: View) -> Sequence[View] | None:
        found = {p["payload"]: p for p in view["payloads"] if p["payload"] in payloads}
        refused = [line for p in found.values() for line in p["problems"]]
        if refused:
            raise TooLate("\n".join(refused))
        is_all = len(found) == len(payloads)
        is_active = all(p["state"] == "active" for p in found.values())
        return tuple(found.values()) if is_all and is_active else None

    return robot.until(f"{what}: payloads active", active, timeout_s=INSTALL_S)


def only_stream(robot: Robot, kind: str) -> View:
    """The row of the only stream of a type that the robot has."""
    return _only(robot.view["streams"], f"stream of type {kind}", kind)


def only_unit(robot: Robot, kind: str) -> str:
    """The only unit of a type that the robot has."""
    return str(_only(robot.ask("units"), f"unit of type {kind}", kind)["unit"])


def _only(rows: Sequence[View], what: str, kind: str) -> View:
    found = [row for row in rows if row["type"] == kind]
    if len(found) != 1:
        raise TooLate(f"expected one {what}, found {found}")
    return found[0]
