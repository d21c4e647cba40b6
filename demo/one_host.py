"""The first demonstration: seven stages on one host that is never restarted."""

from __future__ import annotations

import argparse
import functools
import json
import math
import random
import shutil
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from demo import live, shuffle, stages
from demo.follow_me import FollowMe, follow_me
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
BEGIN, LAST = "I", "III"
STAGES = (BEGIN, "pulled", "put back", "offered", "killed", "II", LAST)

PHASES = ("seen", "verified", "installed", "ready", "in plan", "goal")
NOTE = (
    "Seconds after the first drive of the stage went in, until the phase was complete for all of "
    "its payloads. The published times are for a person with real instruments: they include "
    "the time to fetch, plug in and mount; ours do not, and drives here are folders on a disk."
)

FOLLOW = "follow me through the facility"
POINT = "point at the radiation source"


def main(arguments: Sequence[str]) -> int:
    """Run the demonstration; 0 only if every goal was reached."""
    options = _options(arguments)
    play = functools.partial(_play, options)
    wanted = tuple(name for name in STAGES if name in (options.only or STAGES))
    return perform(Programme(wanted, PHASES, NOTE), play, options, {"seed": options.seed})


def _play(options: argparse.Namespace, work: Path, say: Says) -> Iterator[StageResult]:
    kit = _kit(options, work, say)
    with (
        running(
            work,
            name="panther",
            initial=kit.of([INITIAL]),
            trust=kit.trust,
            more=_more(options),
        ) as robot,
        live.view([robot], is_shown=not (options.json or options.plain)),
    ):
        yield from _played(robot, kit, options, say)


def _more(options: argparse.Namespace) -> str:
    """Further lines of the host's configuration."""
    lines = [] if options.install is None else ["[install]", f'method = "{options.install}"']
    if options.planner:
        lines += ["[planning]", f"planners = {json.dumps(options.planner)}"]
    return "\n".join((*lines, ""))


def _played(
    robot: Robot, kit: Kit, options: argparse.Namespace, say: Says
) -> Iterator[StageResult]:
    dice = random.Random(options.shuffle)
    first, second, third = list(FIRST), list(SECOND), list(THIRD)
    if options.shuffle is not None:
        for names in (first, second, third):
            dice.shuffle(names)
    if not options.only:
        yield from _followed(robot, kit, first, second, say)
        _leave(robot, kit, {*first, *OFFERED, *second} - {CAMERA})
    elif BEGIN in options.only:
        with follow_me(robot, Reference.read(REFERENCE), words=FOLLOW) as following:
            yield _begun(following, kit, first, say)
        _leave(robot, kit, first)
    if options.only and LAST not in options.only:
        return
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
        yield _begun(following, kit, first, say)
        say("pulled: the camera comes out while the robot turns")
        yield following.lose(camera, name="pulled")
        say("put back: the camera goes in again; the goal stands")
        yield following.begin(kit.of([CAMERA]), name="put back", is_given=True)
        say(f"offered: {', '.join(OFFERED)} goes in; later the same goal is given again")
        yield following.offer(kit.of(OFFERED), name="offered")
        say("killed: the worker of the detector that was chosen gets SIGKILL")
        yield following.kill(name="killed")
        say("II: the camera comes out, the thermal camera goes in; the goal stands")
        stages.withdraw(robot, camera)
        yield following.begin(kit.of(second), name="II", published_s=136, is_given=True)


def _begun(following: FollowMe, kit: Kit, first: Sequence[str], say: Says) -> StageResult:
    say(f"{BEGIN}: {', '.join(first)} go in; “{FOLLOW}”")
    return following.begin(kit.of(first), name=BEGIN, published_s=93)


def _leave(robot: Robot, kit: Kit, names: Iterable[str]) -> None:
    """Withdraw the goal, and then drives that are in."""
    robot.ask("halt", now=True)
    stages.withdraw(robot, *(kit.drives[name] for name in names))


def _kit(options: argparse.Namespace, work: Path, say: Says) -> Kit:
    names, wanted = (INITIAL, *FIRST, *OFFERED, *SECOND, *THIRD), _wanted(options)
    folders, cache = dict[str, Path](), CACHE
    if options.shuffle is not None:
        plugins = {name: PLUGINS / name for name in (*names, *LIBRARIES)}
        folders = shuffle.sources(plugins, work / "sources", seed=options.shuffle)
        cache = _shuffled_cache(options.shuffle)
    say("building the payload drives (cached after the first time)")
    return Kit.built(wanted, libraries=LIBRARIES, folders=folders, cache=cache)


def _shuffled_cache(seed: int) -> Path:
    """For drives of this seed; those of others are removed, since each seed makes new ones."""
    above = CACHE.with_name("shuffled")
    for other in above.glob("*"):
        if other.name != str(seed):
            shutil.rmtree(other, ignore_errors=True)
    return above / str(seed)


def _wanted(options: argparse.Namespace) -> Sequence[str]:
    """The plugins whose drives are needed."""
    if not options.only:
        return (INITIAL, *FIRST, *OFFERED, *SECOND, *THIRD)
    parts = {BEGIN: FIRST, LAST: THIRD}
    return (INITIAL, *(name for stage in parts if stage in options.only for name in parts[stage]))


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
    made.add_argument(
        "--only",
        action="append",
        choices=(BEGIN, LAST),
        help="play this stage only; may be given twice",
    )
    made.add_argument(
        "--shuffle",
        type=int,
        metavar="SEED",
        help="replace every name of plugins, components, units and objects by a random one",
    )
    made.add_argument(
        "--planner",
        action="append",
        metavar="NAME",
        help="plan with this planner only; may be given several times [default: all installed]",
    )
    made.add_argument(
        "--install",
        choices=("store", "pip"),
        help="how payloads are installed [default: store]",
    )
    made.add_argument(
        "--wrong-mount",
        type=float,
        default=0.0,
        metavar="DEGREES",
        help="tell the host that the pointer is mounted turned by so much more: must fail",
    )
    return made.parse_args(arguments)
