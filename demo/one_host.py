"""The first demonstration: seven stages on one host that is never restarted."""

from __future__ import annotations

import argparse
import functools
import math
import random
from collections.abc import Iterator, Sequence
from pathlib import Path

from demo import live, shuffle, stages
from demo.follow_me import follow_me
from demo.following import Reference
from demo.kit import CACHE, PLUGINS, Kit
from demo.live import Says
from demo.performance import Programme, parser, perform
from demo.robot import Robot, running
from demo.scenario import random_scenario
from demo.table import StageResult

REFERENCE = PLUGINS / "panorama/nondum_panorama/data/pedestrians.toml"

INITIAL = "mobile-base"
CAMERA = "recorded-camera"
FIRST = (CAMERA, "people-detector", "visual-tracker")
OFFERED = ("pedestrian-detector",)
SECOND = ("thermal-camera",)
THIRD = ("compton-camera", "pan-tilt-unit")
LIBRARIES = ("sdk", "panorama")
LAST = "III"
STAGES = ("I", "pulled", "put back", "offered", "killed", "II", LAST)

PHASES = ("seen", "verified", "installed", "ready", "in plan", "goal")
NOTE = (
    "Seconds after the first drive of the stage went in, until the phase was complete for all of "
    "its payloads. The published times are for a person with real instruments: they include hands "
    "that fetch, plug and mount; ours do not, and drives here are folders on a disk."
)

FOLLOW = "follow me through the facility"
POINT = "point at the radiation source"


def main(arguments: Sequence[str]) -> int:
    """Run the demonstration; 0 only if every goal was reached."""
    options = _options(arguments)
    play = functools.partial(_play, options)
    wanted = (LAST,) if options.only == LAST else STAGES
    return perform(Programme(wanted, PHASES, NOTE), play, options, {"seed": options.seed})


def _play(options: argparse.Namespace, work: Path, say: Says) -> Iterator[StageResult]:
    kit = _kit(options, work, say)
    with (
        running(work, name="panther", initial=kit.of([INITIAL]), trust=kit.trust) as robot,
        live.view([robot], is_shown=not (options.json or options.plain)),
    ):
        yield from _played(robot, kit, options, say)


def _played(
    robot: Robot, kit: Kit, options: argparse.Namespace, say: Says
) -> Iterator[StageResult]:
    dice = random.Random(options.shuffle)
    first, second, third = list(FIRST), list(SECOND), list(THIRD)
    if options.shuffle is not None:
        for names in (first, second, third):
            dice.shuffle(names)
    if options.only != LAST:
        yield from _followed(robot, kit, first, second, say)
        robot.ask("halt", now=True)
        leaving = {*first, *OFFERED, *second} - {CAMERA}
        stages.withdraw(robot, *(kit.drives[name] for name in leaving))
    say(f"{LAST}: no other is in; {', '.join(third)} go in; “{POINT}” (--seed {options.seed})")
    yield stages.point(
        robot,
        kit.of(third),
        random_scenario(options.seed),
        name=LAST,
        words=POINT,
        published_s=199,
        mistold_rad=math.radians(options.wrong_mount),
    )


def _followed(
    robot: Robot, kit: Kit, first: Sequence[str], second: Sequence[str], say: Says
) -> Iterator[StageResult]:
    camera = kit.drives[CAMERA]
    with follow_me(robot, Reference.read(REFERENCE), words=FOLLOW) as following:
        say(f"I: {', '.join(first)} go in; “{FOLLOW}”")
        yield following.begin(kit.of(first), name="I", published_s=93)
        say("pulled: the camera comes out while the robot turns")
        yield following.lose(camera, name="pulled")
        say("put back: the camera goes in again; the goal stands")
        yield following.begin(kit.of([CAMERA]), name="put back", is_given=True)
        say(f"offered: {', '.join(OFFERED)} goes in; later the same is asked for anew")
        yield following.offer(kit.of(OFFERED), name="offered")
        say("killed: the worker of the detector that was chosen gets SIGKILL")
        yield following.kill(name="killed")
        say("II: the camera comes out, the thermal camera goes in; the goal stands")
        stages.withdraw(robot, camera)
        yield following.begin(kit.of(second), name="II", published_s=136, is_given=True)


def _kit(options: argparse.Namespace, work: Path, say: Says) -> Kit:
    names = (INITIAL, *FIRST, *OFFERED, *SECOND, *THIRD)
    folders, cache = dict[str, Path](), CACHE
    if options.shuffle is not None:
        plugins = {name: PLUGINS / name for name in (*names, *LIBRARIES)}
        folders = shuffle.sources(plugins, work / "sources", seed=options.shuffle)
        cache = work / "drives"
    say("building the payload drives (cached after the first time)")
    return Kit.built(names, libraries=LIBRARIES, folders=folders, cache=cache)


def _options(arguments: Sequence[str]) -> argparse.Namespace:
    made = parser(
        "./run demo",
        __doc__ or "",
        epilog="The second demonstration, of three hosts, is `./run demo search`.",
    )
    made.add_argument(
        "--seed",
        type=int,
        default=random.SystemRandom().randrange(1_000_000),
        help="of source and mounts in stage III [default: another one each time]",
    )
    made.add_argument("--only", choices=(LAST,), help="this stage alone")
    made.add_argument(
        "--shuffle",
        type=int,
        metavar="SEED",
        help="replace every name of plugins, components, units and objects by a random one",
    )
    made.add_argument(
        "--wrong-mount",
        type=float,
        default=0.0,
        metavar="DEGREES",
        help="tell the host that the pointer is mounted turned by so much more: must fail",
    )
    return made.parse_args(arguments)
