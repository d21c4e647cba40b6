"""One robot's stage: found, equipped together with the node, told aloud, and it searches."""

from __future__ import annotations

import contextlib
import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from demo.robot import Robot, TooLate, View
from demo.search.person import Person
from demo.search.talking import Talking
from demo.stage import INSTALL_S, PLAN_S, Mark, Stage, until_active
from demo.table import StageResult

WORDS = "search for people"
SAID_SO = re.compile("search for .+")
"""How a host offers it, whatever it calls people."""
ALERT = "i can see a person"
FIND_S = 20.0
UNDERSTAND_S = 15.0
ALERT_S = 60.0
TRIES = 3
"""A person who is not understood says it again."""
PAUSE_S = 0.2


@dataclass(frozen=True, slots=True)
class Search:
    """What stays the same for every robot: the node, and the person beside it."""

    node: Robot
    person: Person
    is_incomplete: bool = False
    """A payload was left out: a robot's first answer that counts the node's parts in is final."""

    def begin(self, robot: Robot, *, published_s: float, begun_s: float) -> Stage:
        """Wait until a robot that was switched on and the node know each other."""
        stage = Stage(robot, robot.name, WORDS, published_s, begun_s)
        for one, other in ((robot, self.node), (self.node, robot)):
            one.until(f"{one.name} finds {other.name}", _is_here(other), timeout_s=FIND_S)
        stage.phase("found")
        return stage

    def equip(self, stage: Stage, drives: Mapping[Robot, Mapping[str, Path]]) -> None:
        """Plug drives in, host by host, and wait until the robot can do what is wanted."""
        robot = stage.robot
        for host, payloads in drives.items():
            for drive in payloads.values():
                host.plug(drive)
        for host, payloads in drives.items():
            until_active(host, tuple(payloads), what=stage.name)
        wanted = {f"{id}@{self.node.name}" for id in own_components(self.node)}
        robot.until(
            f"{', '.join(sorted(wanted))} at {robot.name}",
            lambda view: wanted <= ready_components(view),
            timeout_s=INSTALL_S,
        )
        stage.phase("payloads in")

    def run(self, stage: Stage) -> StageResult:
        """Say the words to the node; the robot must have the goal, and the node must say the
        alert, that a person understands."""
        robot, begun_wall_s = stage.robot, self.node.now_s()
        marks = (Mark(robot), Mark(self.node))
        self._until_possible(robot)
        tries = self._say(stage)
        stage.planned()
        stage.phase("understood", _when(marks[0], "GoalGiven"))
        stage.phase("in plan", _when(marks[0], "PlanMade"))
        said_s, file = self._alert(begun_wall_s, stage)
        stage.phase("alert", time.monotonic() - (self.node.now_s() - said_s))
        goal = robot.until(f"{stage.name}: the goal reached", _reached, timeout_s=PLAN_S)
        stage.faults += self._unfed(marks[1], robot)
        ran = {robot.name: _started(marks[0]), self.node.name: _started(marks[1])}
        stage.faults += [
            f"{id} of {host} did nothing"
            for host, ids in self._needed(stage).items()
            for id in sorted(ids - ran[host])
        ]
        measure = (
            f"“{WORDS}”, said to {self.node.name}{_again(tries)}, became goal {goal['id']} of "
            f"{robot.name}; {_where(ran)} had a part in it; then “{ALERT}” was heard in "
            f"{file.name} of {self.node.name}'s speaker"
        )
        return stage.result(reached=True, measure=measure)

    def _until_possible(self, robot: Robot) -> None:
        """Wait until the robot says that it can, and the node knows the words: its own account of
        the facts that came over the network."""
        Talking(self.node).has_learnt()
        deadline_s = time.monotonic() + PLAN_S * robot.slowness
        while time.monotonic() < deadline_s:
            offers = robot.ask("goals")["can"]
            fitting = [row for row in offers if SAID_SO.fullmatch(row["words"])]
            if any(row["now"] == "can" for row in fitting):
                return
            givers = (giver for row in offers for giver in row["from"])
            if self.is_incomplete and any(giver.endswith(f"@{self.node.name}") for giver in givers):
                break
            time.sleep(PAUSE_S)
        raise TooLate(f"{robot.name} does not say that it can “{WORDS}”, but:\n{offers}")

    def _say(self, stage: Stage) -> int:
        """Say it until the robot has it as a goal; how often that was. Raises `TooLate`."""
        talking = Talking(self.node)
        for number in range(1, TRIES + 1):
            talking.hear(self.person.saying(WORDS, f"{stage.name}-{number}.wav"))
            with contextlib.suppress(TooLate):
                stage.robot.until("the goal", _given, timeout_s=UNDERSTAND_S)
                return number
        told = "\n".join(row["text"] for row in self.node.view["told"])
        raise TooLate(f"{stage.robot.name} was given no goal; {self.node.name} told:\n{told}")

    def _needed(self, stage: Stage) -> Mapping[str, set[str]]:
        """Host → the components that are expected to have a part: those of the robot's drives, and
        all of the node's that can act."""
        robot = stage.robot
        acting = {row["component"] for row in self.node.view["components"] if row["behaviours"]}
        return {
            robot.name: robot.components_on(robot.plugged),
            self.node.name: acting & own_components(self.node),
        }

    def _unfed(self, mark: Mark, robot: Robot) -> Sequence[str]:
        """A fault if nothing that the node did was done with a stream of the robot."""
        rows = (row for row in mark.journal() if row["event"] == "BehaviourStarted")
        streams = (value for row in rows for value in row["detail"]["arguments"].values())
        if any(stream.startswith(f"{robot.name}__") for stream in streams):
            return ()
        return (f"nothing of {robot.name} was looked at by {self.node.name}",)

    def _alert(self, since_wall_s: float, stage: Stage) -> tuple[float, Path]:
        """When the node's speaker said that somebody was found, and in which file; what a person
        does not understand as that does not count. Raises `TooLate`."""
        talking = Talking(self.node)
        deadline_s = time.monotonic() + ALERT_S * self.node.slowness
        heard: dict[Path, tuple[str, ...]] = {}
        while time.monotonic() < deadline_s:
            for said_s, file in talking.said_since(since_wall_s):
                if file not in heard:
                    heard[file] = self.person.understood(file)
                    if ALERT in heard[file]:
                        return said_s, file
            time.sleep(PAUSE_S)
        raise TooLate(f"{stage.name}: no alert; {self.node.name}'s speaker said {heard}")


def own_components(host: Robot) -> set[str]:
    """The components that a host has itself."""
    rows = host.view["components"]
    return {row["component"] for row in rows if row["host"] == host.name}


def ready_components(view: View) -> set[str]:
    """The components that are ready, peers' too."""
    return {row["component"] for row in view["components"] if row["ready"]}


def _is_here(other: Robot) -> Any:
    sentence = f"the host {other.name} is here"
    return lambda view: any(row["text"] == sentence for row in view["told"])


def _given(view: View) -> View | None:
    return next((goal for goal in view["goals"] if goal["text"] == WORDS), None)


def _reached(view: View) -> View | None:
    goal = _given(view)
    return goal if goal and goal["state"] == "reached" else None


def _when(mark: Mark, event: str) -> float:
    """When something happened first, by a host's journal; all hosts here share one clock."""
    return float(next(row["monotonic"] for row in mark.journal() if row["event"] == event))


def _started(mark: Mark) -> set[str]:
    """The components of a host that did something, as its own journal says."""
    rows = (row for row in mark.journal() if row["event"] == "BehaviourStarted")
    return {row["subject"] for row in rows if "@" not in row["subject"]}


def _where(ran: Mapping[str, set[str]]) -> str:
    return ", ".join(f"{id}@{host}" for host, ids in ran.items() for id in sorted(ids))


def _again(tries: int) -> str:
    return "" if tries == 1 else f" {tries} times"
