"""`./run demo`: seven stages on one host that is never restarted."""

from __future__ import annotations

import argparse
import json
import math
import random
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from demo import live, shuffle, stages, table
from demo.drives import build, payload_id
from demo.follow_me import follow_me
from demo.following import Reference
from demo.robot import Robot, TooLate, running
from demo.scenario import random_scenario
from demo.table import StageResult

ROOT = Path(__file__).parent.parent
PLUGINS = ROOT / "plugins"
CACHE = ROOT / ".run/drives"
REFERENCE = PLUGINS / "panorama/nondum_panorama/data/pedestrians.toml"

INITIAL = "mobile-base"
CAMERA = "recorded-camera"
FIRST = (CAMERA, "people-detector", "visual-tracker")
OFFERED = ("pedestrian-detector",)
SECOND = ("thermal-camera",)
THIRD = ("compton-camera", "pan-tilt-unit")
LIBRARIES = ("sdk", "panorama")
STAGES = ("I", "pulled", "put back", "offered", "killed", "II", "III")

FOLLOW = "follow me through the facility"
POINT = "point at the radiation source"


@dataclass(frozen=True, slots=True)
class Kit:
    """The drives of the demonstration, by the names of the plugin folders they were built from."""

    drives: Mapping[str, Path]
    payloads: Mapping[str, str]
    """Payload ids."""

    def of(self, names: Sequence[str]) -> dict[str, Path]:
        """Payload id → drive, in the order of `names`."""
        return {self.payloads[name]: self.drives[name] for name in names}


def main() -> int:
    """Run the demonstration; 0 only if every goal was reached."""
    options = _options()
    say = live.Says(is_shown=not options.json)
    work = Path(tempfile.mkdtemp(prefix="nondum-demo-"))
    results: list[StageResult] = []
    try:
        kit = _kit(options, work, say)
        with (
            running(work, name="panther", initial=kit.of([INITIAL])) as robot,
            live.view(robot, is_shown=not (options.json or options.plain)),
        ):
            for result in _played(robot, kit, options, say):
                results.append(result)
                say(f"  {result.measure}")
    except TooLate as late:
        print(f"error: {late}", file=sys.stderr)
    finally:
        if options.keep:
            print(f"kept: {work}", file=sys.stderr)
        else:
            shutil.rmtree(work, ignore_errors=True)
    if options.json:
        print(json.dumps(table.as_data(results, seed=options.seed), indent=2))
    else:
        print(table.as_text(results))
    is_whole = tuple(result.name for result in results) == STAGES
    return 0 if is_whole and all(result.reached for result in results) else 1


def _played(
    robot: Robot, kit: Kit, options: argparse.Namespace, say: live.Says
) -> Iterator[StageResult]:
    dice = random.Random(options.shuffle)
    first, second, third = list(FIRST), list(SECOND), list(THIRD)
    if options.shuffle is not None:
        for names in (first, second, third):
            dice.shuffle(names)
    yield from _followed(robot, kit, first, second, say)
    robot.ask("halt", now=True)
    leaving = {*first, *OFFERED, *second} - {CAMERA}
    stages.withdraw(robot, *(kit.drives[name] for name in leaving))
    say(f"III: those come out; {', '.join(third)} go in; “{POINT}” (--seed {options.seed})")
    yield stages.point(
        robot,
        kit.of(third),
        random_scenario(options.seed),
        name="III",
        words=POINT,
        published_s=199,
        mistold_rad=math.radians(options.wrong_mount),
    )


def _followed(
    robot: Robot, kit: Kit, first: Sequence[str], second: Sequence[str], say: live.Says
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


def _kit(options: argparse.Namespace, work: Path, say: live.Says) -> Kit:
    names = (INITIAL, *FIRST, *OFFERED, *SECOND, *THIRD)
    folders = {name: PLUGINS / name for name in (*names, *LIBRARIES)}
    cache = CACHE
    if options.shuffle is not None:
        folders = shuffle.sources(folders, work / "sources", seed=options.shuffle)
        cache = work / "drives"
    say("building the payload drives (cached after the first time)")
    drives = build(
        [folders[name] for name in names],
        libraries=[folders[name] for name in LIBRARIES],
        cache=cache,
    )
    by_name = {name: drives[folders[name].name] for name in names}
    return Kit(by_name, {name: payload_id(drive) for name, drive in by_name.items()})


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./run demo", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON document, nothing else")
    parser.add_argument("--plain", action="store_true", help="no live view, even on a terminal")
    parser.add_argument(
        "--seed",
        type=int,
        default=random.SystemRandom().randrange(1_000_000),
        help="of source and mounts in stage III [default: another one each time]",
    )
    parser.add_argument(
        "--shuffle",
        type=int,
        metavar="SEED",
        help="replace every name of plugins, components, units and objects by a random one",
    )
    parser.add_argument(
        "--wrong-mount",
        type=float,
        default=0.0,
        metavar="DEGREES",
        help="tell the host that the pointer is mounted turned by so much more: must fail",
    )
    parser.add_argument("--keep", action="store_true", help="keep the work folder")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
