"""The stages of one goal, “follow me”: reached, lost, reached again, done otherwise, by another."""

from __future__ import annotations

import math
import os
import signal
import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from demo.body_motion import Motion, motion
from demo.choice import Choice, choices
from demo.fall import Fall
from demo.following import TOLERANCE_RAD, WANTED_FRACTION, WINDOW_S, Reference, score_following
from demo.listening import StreamRecord, listening
from demo.robot import Robot, TooLate, View
from demo.stage import PLAN_S, Stage, only_stream
from demo.table import StageResult

FOLLOW_S = 60.0
SETTLED_S = 0.5
"""Standing for so long before a stream begins: the recording hangs where the body looks then."""
TURNING_S = 0.3
TURNING_RAD = math.radians(1.5)
BRAKE_S = 1.5
"""From full speed the base needs less."""
STAND_S = 4.0
"""Long enough for a tracker that was forgotten to begin searching."""
LEFT_ALONE_S = 2.0
"""How long a running plan must go on after a better way was offered."""
PAUSE_S = 0.1


@dataclass
class FollowMe:
    """One robot that is asked to follow. Its methods are stages, in the order they are called."""

    robot: Robot
    body: StreamRecord
    reference: Reference
    words: str
    start_rad: float = 0.0
    """Where the body looked when the stream of images began."""

    def begin(
        self,
        drives: Mapping[str, Path],
        *,
        name: str,
        published_s: float | None = None,
        is_given: bool = False,
    ) -> StageResult:
        """Plug drives in, ask to be followed, and measure whether the robot does.

        `is_given`: the goal was given before and waits for what the drives bring.
        """
        self.start_rad = self._still_heading()
        stage = self._stage(name, published_s)
        for drive in drives.values():
            self.robot.plug(drive)
        stage.installed(tuple(drives))
        share = self._asked(stage, is_given=is_given)
        return stage.result(reached=share >= WANTED_FRACTION, measure=_told(share))

    def ask(self, *, name: str) -> StageResult:
        """Ask to be followed, with what there is, and measure whether the robot does."""
        self.start_rad = self._still_heading()
        stage = self._stage(name)
        share = self._asked(stage)
        return stage.result(reached=share >= WANTED_FRACTION, measure=_told(share))

    def lose(self, drive: Path, *, name: str) -> StageResult:
        """Pull a drive while the body turns: all that needed it ends at once, the body stands, and
        the host says what would help."""
        lost = self.robot.components_on([drive.name])
        return self.bereave(lambda: self.robot.pull(drive.name), lost, name=name, since="the pull")

    def bereave(
        self,
        take: Callable[[], object],
        lost: Collection[str],
        *,
        name: str,
        since: str,
        brake_s: float = BRAKE_S,
    ) -> StageResult:
        """Take components away while the body turns, and see that all goes down that needed them:
        the steps of the plan from the first of theirs on.

        `since` says in words what `take` does; the body may take `brake_s` from then to stand.
        """
        steps = self.robot.view["plan"]["steps"]
        self._turning()
        stage = self._stage(name)
        stage.plan = tuple(step["action"] for step in steps)
        take()
        goal = self.robot.until(f"{name}: the goal suspended", _suspended, timeout_s=PLAN_S)
        stage.phase("told")
        begin_s = stage.begun_s + brake_s
        self._until_odometry(begin_s + STAND_S)
        fall = Fall.of(stage.journal())
        stage.phase("halted", fall.decided_s)
        others = {step["component"] for step in steps} - {*lost}
        first = next((n for n, step in enumerate(steps) if step["component"] in lost), 0)
        stage.faults += fall.faults(stage.plan[first:], sorted(others))
        moved = motion(self.body.headings, self.body.places, begin_s, begin_s + STAND_S)
        if moved is None or not moved.is_still:
            stage.faults.append("the body does not stand")
        said = [s for s in stage.told() if goal["reason"] in s and any(id in s for id in lost)]
        if not said:
            stage.faults.append(f"no sentence says that {', '.join(sorted(lost))} is missing")
        measure = (
            f"{len(stage.plan[first:])} behaviours down in one tick, "
            f"{_ms(stage.phases_s['halted'])} after {since}, and all {len(stage.plan)} ended "
            f"{_ms(fall.took_s)} later; then {moved} in {STAND_S:.0f} s; "
            f"“{said[0] if said else ''}”"
        )
        return stage.result(reached=bool(fall.ticks), measure=measure)

    def offer(self, drives: Mapping[str, Path], *, name: str) -> StageResult:
        """Plug in another way to do one of the steps. The running plan goes on; asked again, the
        robot takes the better way, and says why."""
        stage, goal = self._stage(name), self.robot.view["plan"]["id"]
        for drive in drives.values():
            self.robot.plug(drive)
        stage.installed(tuple(drives))
        new = self.robot.components_on([drive.name for drive in drives.values()])
        offered = self.robot.until(
            f"{name}: an alternative",
            lambda view: next((c for c in choices(view["tree"]) if new & {*c.others}), None),
            timeout_s=PLAN_S,
        )
        self._until_odometry(time.monotonic() + LEFT_ALONE_S)
        if Fall.of(stage.journal()).endings:
            stage.faults.append("a plan that worked was preempted")
        self.robot.ask("halt", id=goal)
        self.robot.until("halted", lambda view: not view["plan"]["steps"], timeout_s=PLAN_S)
        self.start_rad = self._still_heading()
        share = self._asked(stage)
        taken = self._choice()
        if taken.component not in new or offered.component not in taken.others:
            stage.faults.append(f"{offered.component} was to be replaced by {', '.join(new)}")
        if not offered.cost > taken.cost < taken.others_cost:
            stage.faults.append("what was taken is no better")
        measure = f"at first {offered}; asked again {taken}; {_told(share)}"
        return stage.result(reached=share >= WANTED_FRACTION, measure=measure)

    def kill(self, *, name: str) -> StageResult:
        """Kill the worker of the component that was chosen over another: that one takes over."""
        chosen = self._choice()
        stage = self._stage(name)
        pids = _pids(self.robot.view)
        os.kill(pids[chosen.component], signal.SIGKILL)
        self.robot.until(
            f"{name}: another component took over",
            lambda view: any(s["component"] in chosen.others for s in view["plan"]["steps"]),
            timeout_s=PLAN_S,
        )
        stage.planned()
        camera = only_stream(self.robot, "image")
        share = self._followed(camera, stage)
        started = [e["subject"] for e in stage.journal() if e["event"] == "BehaviourStarted"]
        if camera["component"] in started:
            stage.faults.append(f"{camera['component']} was started again for nothing")
        now = _pids(self.robot.view)
        others = {*pids} - {chosen.component}
        stage.faults += [f"{id} got another worker" for id in others if now.get(id) != pids[id]]
        if not any(chosen.component in s and "not ready" in s for s in stage.told()):
            stage.faults.append(f"no sentence says that {chosen.component} is not ready")
        # Not `_choice`: the plan has no alternative while the killed worker is being restarted.
        running = {step["component"] for step in self.robot.view["plan"]["steps"]}
        taken = sorted(running & set(chosen.others))
        if chosen.component in running or not taken:
            stage.faults.append(f"{chosen.component} was taken again, though another worked")
        measure = (
            f"{', '.join(taken)} took over {_ms(stage.phases_s['in plan'])} after the worker of "
            f"{chosen.component} was killed; {_told(share)}"
        )
        return stage.result(reached=share >= WANTED_FRACTION, measure=measure)

    # What a person would see

    def _stage(self, name: str, published_s: float | None = None) -> Stage:
        return Stage(self.robot, name, self.words, published_s)

    def _asked(self, stage: Stage, *, is_given: bool = False) -> float:
        """Ask to be followed, unless that was done, and measure it from the first image on."""
        camera = only_stream(self.robot, "image")
        if not is_given:
            self.robot.ask("goal", words=self.words)
        stage.planned()
        return self._followed(camera, stage)

    def _followed(self, camera: View, stage: Stage) -> float:
        """The best share of frames with the person ahead, over any window of the stage."""
        best, deadline = 0.0, time.monotonic() + FOLLOW_S
        with listening(self.robot.control, camera["stream"]) as heard:
            while best < WANTED_FRACTION and time.monotonic() < deadline:
                _pause()
                frames = [frame for frame in tuple(heard.frames) if frame[0] > stage.begun_s]
                if frames:
                    headings = tuple(self.body.headings)
                    share = score_following(
                        headings, frames, self.reference, start_rad=self.start_rad
                    )
                    best = max(best, share)
        if best >= WANTED_FRACTION:
            stage.phase("goal")
        return best

    def _choice(self) -> Choice:
        """The step of the running plan that more than one component could do."""
        found = list(choices(self.robot.view["tree"]))
        if len(found) != 1:
            raise TooLate(f"expected one step with alternatives, found {found}")
        return found[0]

    def _still_heading(self) -> float:
        """The heading, once the body has stood for `SETTLED_S`. Raises `TooLate`."""
        deadline = time.monotonic() + PLAN_S
        while time.monotonic() < deadline:
            moved = self._lately(SETTLED_S)
            if moved is not None and moved.is_still:
                return self.body.headings[-1][1]
            _pause()
        raise TooLate("the body does not stand still, or tells no heading")

    def _turning(self) -> None:
        """Wait until the body turns: standing still proves nothing of one that stood before."""
        deadline = time.monotonic() + PLAN_S
        while time.monotonic() < deadline:
            moved = self._lately(TURNING_S)
            if moved is not None and moved.turned_rad > TURNING_RAD:
                return
            _pause()
        raise TooLate("the body does not turn")

    def _lately(self, seconds: float) -> Motion | None:
        """How the body moved just now."""
        headings, places = tuple(self.body.headings), tuple(self.body.places)
        end_s = headings[-1][0] if headings else 0.0
        return motion(headings, places, end_s - seconds, end_s)

    def _until_odometry(self, stamp_s: float) -> None:
        """Wait until odometry has told of a time. Raises `TooLate`."""
        deadline = time.monotonic() + PLAN_S
        while not self.body.headings or self.body.headings[-1][0] < stamp_s:
            if time.monotonic() > deadline:
                raise TooLate("the body tells no heading any more")
            _pause()


@contextmanager
def follow_me(robot: Robot, reference: Reference, *, words: str) -> Iterator[FollowMe]:
    """The stages of following, on a robot whose body tells how it moves."""
    with listening(robot.control, only_stream(robot, "pose")["stream"]) as body:
        yield FollowMe(robot, body, reference, words)


def _told(share: float) -> str:
    return (
        f"the person within ±{math.degrees(TOLERANCE_RAD):.0f}° of the heading in {share:.0%} of "
        f"frames over {WINDOW_S:.0f} s (at least {WANTED_FRACTION:.0%})"
    )


def _ms(seconds: float) -> str:
    return f"{1000 * seconds:.0f} ms"


def _pids(view: View) -> dict[str, int]:
    """Component → the process of its worker."""
    return {row["component"]: row["pid"] for row in view["components"]}


def _suspended(view: View) -> View | None:
    return next((row for row in view["goals"] if row["state"] == "suspended"), None)


def _pause() -> None:
    threading.Event().wait(PAUSE_S)
