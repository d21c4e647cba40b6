"""Three payloads at once against one alone: `python -m benchmarks.at_once`.

A daemon has just started, and a person plugs in what a robot needs for its first goal: three
drives, as in the demonstration's first stage. How much longer does that take than the slowest of
the three alone? Writes docs/benchmarks/at_once.md.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks import measuring
from benchmarks.measuring import Spread
from benchmarks.recompose import payloads
from benchmarks.recompose.processes import await_calm
from demo.robot import Robot, View, running

from nondum.wheelhouse.build import build
from nondum.wheelhouse.format.target import Target

NAMES = ("first", "second", "third")
HOST = "bench"
CALM_S = 30.0
TIMEOUT_S = 120.0


def variant(name: str, work: Path) -> Path:
    """A drive with the small payload of benchmarks/recompose under another name."""
    source = work / f"source-{name}"
    shutil.copytree(payloads.HERE / "plugins/small", source)
    (source / "bench_small").rename(source / f"bench_{name}")
    for path in (path for path in source.rglob("*") if path.is_file()):
        path.write_text(path.read_text(encoding="utf-8").replace("small", name), encoding="utf-8")
    drive = work / f"drive-{name}"
    options = build.Options(targets=(Target.here(),), libraries=(payloads.SDK,))
    build.build(source, drive, options, lambda *_: None)
    return drive


def planned_s(work: Path, drives: Sequence[Path], names: Sequence[str]) -> float:
    """Seconds from the insertion into a daemon that has just started to a plan with all in it."""
    shutil.rmtree(work, ignore_errors=True)
    os.sync()
    await_calm(timeout_s=CALM_S)
    with running(work, name=HOST, initial={}) as robot:
        began_s = time.monotonic()
        for drive in drives:
            robot.plug(drive)
        until(robot, "all ready", ready(names))
        facts = " ".join(f"(weighed-{name} {HOST})" for name in names)
        robot.ask("goal", pddl=f"(and {facts})")
        until(robot, "a plan", planned(names))
        return time.monotonic() - began_s


def until(robot: Robot, what: str, found: Callable[[View], bool]) -> None:
    """Wait for a view. Raises `TooLate`."""
    robot.until(what, found, timeout_s=TIMEOUT_S)


def ready(names: Sequence[str]) -> Callable[[View], bool]:
    """Whether all of them are."""
    wanted = {f"bench-{name}" for name in names}
    return lambda view: (
        wanted <= {row["component"] for row in view["components"] if row["state"] == "ready"}
    )


def planned(names: Sequence[str]) -> Callable[[View], bool]:
    """Whether each has a step in the plan."""

    def found(view: View) -> bool:
        actions = " ".join(step["action"] for step in view["plan"]["steps"])
        return all(f"bench-{name}" in actions for name in names)

    return found


def page(together: Spread, alone: Spread, repeats: int) -> str:
    """The page."""
    rows = [
        ["three at once", format(together, ".0f")],
        ["the slowest of them alone", format(alone, ".0f")],
        ["at once ÷ alone", measuring.ratio(together, alone)],
    ]
    return f"""# Three payloads at once into a daemon that has just started

`python -m benchmarks.at_once` wrote this page. Three small payloads (those of
[recompose](recompose.md), under three names) go in as soon as the daemon shows its first view: its
children, spare worker and planners are not there yet. Milliseconds until a goal that needs all of
them, given when they are ready, has a plan with a step of each; then the same of each alone, of
which the slowest counts. {repeats} repeats in turn, a new host each; medians (lowest-highest).

{measuring.table(["", "ms"], rows)}

Machine: {measuring.machine()}.
"""


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    chosen = parser.parse_args()
    together, alone = [], []
    with tempfile.TemporaryDirectory(prefix="nondum-") as folder:
        work = Path(folder)
        drives = {name: variant(name, work) for name in NAMES}
        for _ in range(chosen.repeats):
            host = work / "host"
            together.append(planned_s(host, [*drives.values()], NAMES) * 1000)
            alone.append(max(planned_s(host, [drives[n]], [n]) for n in NAMES) * 1000)
            print(f"{together[-1]:.0f} ms at once, {alone[-1]:.0f} ms alone", file=sys.stderr)
    found = Spread(tuple(together)), Spread(tuple(alone))
    measuring.write("at_once", page(*found, chosen.repeats))


if __name__ == "__main__":
    main()
