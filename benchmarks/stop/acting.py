"""Stops of robots that act: the goals of both demonstrations, given, held and stopped in turns."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchmarks.stop.results import Stop, Way
from demo.kit import Kit
from demo.one_host import FIRST, INITIAL, LIBRARIES
from demo.robot import NONDUM, Robot, View, running
from demo.search.person import Person
from demo.search.searching import own_components, ready_components
from demo.search.sites import site
from demo.search.talking import Talking
from demo.search.three_hosts import BASE, CAMERA, NODE, ROBOT, search_kit
from demo.stage import INSTALL_S, Mark, until_active

from nondum.host.config.stop_keys import code_of
from nondum.host.sandbox.helper.stop_key import EV_KEY, EVENT
from nondum.planning.words.stop_words import STOPS

FOLLOW = "follow me through the facility"
FOR_NODE = ("people-detector", "visual-tracker", "speech")
HOLD_S = 60.0
STOP_S = 10.0
"""A stop that takes longer is counted as missed."""
LOOK_S = 0.02
KEY = "KEY_ENTER"
FIRST_DEMO, SECOND_DEMO = "first demonstration", "second demonstration"
Press = Callable[[], None]
Says = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Scene:
    """A robot that can be asked to follow, and the ways to stop it."""

    name: str
    robot: Robot
    ways: Mapping[str, Callable[[], float]]
    """How → does it, and gives when a person had done their part (monotonic clock)."""


def measured(scene: Scene, rounds: int, say: Says) -> Iterator[Way]:
    """Each way in turn, round by round."""
    stops: dict[str, list[Stop]] = {how: [] for how in scene.ways}
    for number in range(rounds):
        for how, do in scene.ways.items():
            say(f"{scene.name}, round {number + 1}: {how}")
            found = stopped(scene.robot, do)
            stops[how] += [found] if found is not None else []
    for how, found_stops in stops.items():
        yield Way(scene.name, how, tuple(found_stops), rounds - len(found_stops))


def stopped(robot: Robot, do: Callable[[], float]) -> Stop | None:
    """Have the robot follow, stop it, and wait until it does nothing; None: it went on."""
    robot.ask("goal", words=FOLLOW)
    steps = robot.until(f"{robot.name} follows", _all_run, timeout_s=HOLD_S)
    mark, actions = Mark(robot), [step["action"] for step in steps]
    since_s, deadline_s = do(), time.monotonic() + STOP_S * robot.slowness
    found = None
    while found is None and time.monotonic() < deadline_s:
        try:
            found = Stop.of(mark.journal(), actions, since_s)
        except ValueError:
            time.sleep(LOOK_S)
    robot.ask("halt", now=True)
    robot.until("nothing runs", lambda view: not view["plan"]["steps"], timeout_s=HOLD_S)
    return found


@contextmanager
def first(work: Path) -> Iterator[Scene]:
    """One host with camera, detector, tracker and base."""
    kit = Kit.built((INITIAL, *FIRST), libraries=LIBRARIES, folders={})
    with _with_key(work, "panther", kit.of([INITIAL]), kit) as (robot, press):
        drives = kit.of(FIRST)
        for drive in drives.values():
            robot.plug(drive)
        until_active(robot, tuple(drives), what=FIRST_DEMO)
        yield Scene(FIRST_DEMO, robot, _ways(robot, press))


@contextmanager
def second(work: Path) -> Iterator[Scene]:
    """A robot with base and camera, and a node that detects, tracks and listens."""
    kit = search_kit(work)
    person = Person(work / "person", expects=STOPS)
    with ExitStack() as stack:
        where = stack.enter_context(site(work, (ROBOT, NODE), is_loopback=True))
        hosts: dict[str, tuple[Robot, Press]] = {}
        for name, initial in ((NODE, ()), (ROBOT, (BASE,))):
            more = where.prepare(name, work / name / "state")
            made = _with_key(work / name, name, kit.of(initial), kit, more)
            hosts[name] = stack.enter_context(made)
        (node, _), (robot, press) = hosts[NODE], hosts[ROBOT]
        _equipped(kit, node, robot)
        talking = Talking(node)
        talking.has_learnt()
        words = [person.saying(said, f"{n}.wav") for n, said in enumerate(STOPS)]
        turns = itertools.cycle(words)

        def say() -> float:
            began_s = time.monotonic()
            talking.hear(next(turns))
            return began_s

        more_ways = {
            "`nondum stop` typed at the node": lambda: _typed(node),
            "said to the node, as a WAV file that is whole": say,
        }
        yield Scene(SECOND_DEMO, robot, {**_ways(robot, press), **more_ways})


def _equipped(kit: Kit, node: Robot, robot: Robot) -> None:
    drives = {node: kit.of(FOR_NODE), robot: kit.of([CAMERA])}
    for host, payloads in drives.items():
        for drive in payloads.values():
            host.plug(drive)
        until_active(host, tuple(payloads), what=SECOND_DEMO)
    wanted = {f"{id}@{node.name}" for id in own_components(node)}
    robot.until(
        f"{', '.join(sorted(wanted))} at {robot.name}",
        lambda view: wanted <= ready_components(view),
        timeout_s=INSTALL_S,
    )


def _ways(robot: Robot, press: Press) -> dict[str, Callable[[], float]]:
    return {
        "`nondum stop` typed, from Enter on": lambda: _typed(robot),
        "asked over the control socket": lambda: _asked(robot),
        "stop key": lambda: _timed(press),
    }


def _typed(robot: Robot) -> float:
    began_s = time.monotonic()
    command = [*NONDUM, "--control", str(robot.control), "stop"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return began_s


def _asked(robot: Robot) -> float:
    began_s = time.monotonic()
    robot.ask("goal", words=STOPS[0])
    return began_s


def _timed(press: Press) -> float:
    began_s = time.monotonic()
    press()
    return began_s


@contextmanager
def _with_key(
    work: Path, name: str, initial: Mapping[str, Path], kit: Kit, more: str = ""
) -> Iterator[tuple[Robot, Press]]:
    """A host that listens to a key, and what presses it."""
    work.mkdir(parents=True, exist_ok=True)
    pipe = work / "key"
    os.mkfifo(pipe)
    keyboard = os.open(pipe, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    section = f'\n[stop]\ndevice = "/dev/input/event0"\nkey = "{KEY}"\n'
    inside = [sys.executable, "-m", "benchmarks.stop.with_key", str(pipe)]
    try:
        with running(
            work,
            name=name,
            initial=initial,
            trust=kit.trust,
            more=more + section,
            inside=inside,
        ) as robot:
            yield robot, lambda: press(keyboard)
    finally:
        os.close(keyboard)


def press(keyboard: int) -> None:
    """Down, and up."""
    for value in (1, 0):
        os.write(keyboard, EVENT.pack(0, 0, EV_KEY, code_of(KEY) or 0, value))
        os.write(keyboard, EVENT.pack(0, 0, 0, 0, 0))  # EV_SYN


def _all_run(view: View) -> Sequence[View] | None:
    """The steps of the plan, once each is established."""
    steps: Sequence[View] = view["plan"]["steps"]
    is_so = bool(steps) and all(step["state"] == "established" for step in steps)
    return steps if is_so else None
