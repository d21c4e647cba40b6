"""`./run demo`: three stages on one host that is never restarted."""

from __future__ import annotations

import argparse
import json
import math
import random
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from demo import live, shuffle, stages, table
from demo.drives import build, payload_id
from demo.following import Reference
from demo.robot import Robot, TooLate, running
from demo.scenario import random_scenario
from demo.table import StageResult

ROOT = Path(__file__).parent.parent
PLUGINS = ROOT / "plugins"
CACHE = ROOT / ".run/drives"
REFERENCE = PLUGINS / "panorama/nondum_panorama/data/pedestrians.toml"

INITIAL = "mobile-base"
FIRST = ("recorded-camera", "people-detector", "visual-tracker")
SECOND = ("thermal-camera",)
THIRD = ("compton-camera", "pan-tilt-unit")
LIBRARIES = ("sdk", "panorama")

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
            _play(robot, kit, options, results, say)
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
    return 0 if len(results) == 3 and all(result.reached for result in results) else 1


def _play(
    robot: Robot,
    kit: Kit,
    options: argparse.Namespace,
    results: list[StageResult],
    say: live.Says,
) -> None:
    reference = Reference.read(REFERENCE)
    dice = random.Random(options.shuffle)
    first, second, third = list(FIRST), list(SECOND), list(THIRD)
    if options.shuffle is not None:
        for names in (first, second, third):
            dice.shuffle(names)
    say(f"stage I: {', '.join(first)} go in; “{FOLLOW}”")
    results.append(
        stages.follow(robot, kit.of(first), reference, name="I", words=FOLLOW, published_s=93)
    )
    say(results[-1].measure)
    say("stage II: the camera comes out, the thermal camera goes in; the goal stands")
    stages.withdraw(robot, kit.drives["recorded-camera"])
    results.append(
        stages.follow(
            robot,
            kit.of(second),
            reference,
            name="II",
            words=FOLLOW,
            published_s=136,
            is_given=True,
        )
    )
    say(results[-1].measure)
    say(f"stage III: those come out; {', '.join(third)} go in; “{POINT}” (--seed {options.seed})")
    robot.ask("halt", now=True)
    stages.withdraw(robot, *(kit.drives[n] for n in (*second, "people-detector", "visual-tracker")))
    scenario = random_scenario(options.seed)
    results.append(
        stages.point(
            robot,
            kit.of(third),
            scenario,
            name="III",
            words=POINT,
            published_s=199,
            mistold_rad=math.radians(options.wrong_mount),
        )
    )
    say(results[-1].measure)


def _kit(options: argparse.Namespace, work: Path, say: live.Says) -> Kit:
    names = (INITIAL, *FIRST, *SECOND, *THIRD)
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
