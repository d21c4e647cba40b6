"""The long form of the tests of drives: `python -m tests.faults.drive_figures WHAT…`.

`hostile`: the whole corpus ten times through one daemon. `yanks`: 500 drives yanked at any moment.
`crowd`: a hundred drives in ten seconds. `soak`: good and hostile drives by turns, for long.
Each is written to a folder when it is done, and docs/reliability/drives.md from all that are there.
With `--due`, those that are not in the folder yet are done until the `--minutes` are over (one that
has begun goes on to its end), and the page stays as it is. Exits with 1 if anything was wrong.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import platform
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tests.campaign.progress import Limit, Round
from tests.faults import crowds
from tests.faults.footprint import slope
from tests.faults.hostile import FAMILIES, Bench, HostileDrive
from tests.faults.hostile.gauntlet import gauntlet
from tests.faults.yanks import PHASES, bench, yank_all
from tests.kit.running_host import running

from nondum.host.jobs.children import QUIET_S

FOLDER = Path("build/drives")
PAGE = Path("docs/reliability/drives.md")
AT_ONCE = 16
CROWD, WITHIN_S = 100, 10.0
TURNS = 40
"""Good drives, and as many hostile ones, between two looks at the daemon while it soaks."""
CYCLES_AN_HOUR = 360
"""As many as 8,640 a day are."""
SLOPES = ("rss_mb", "pss_mb", "descriptors", "files", "catalogue_mb")
FLAWS = ("wrong", "without_remedy", "canaries", "strays", "touched", "controls")
REFUSED_S = 2.0
COLUMNS = (
    "| | resident | share | descriptors | threads | processes | zombies | mounts | files "
    "| catalogue |"
)

Figures = dict[str, Any]


def hostile(root: Path, options: argparse.Namespace) -> Figures:
    """Every drive alone once, which is timed, then all of them some at a time."""
    with gauntlet(root) as run:
        drives = run.make([case for cases in FAMILIES.values() for case in cases])
        rest()
        run.measure()
        for number in range(options.rounds):
            run.round(drives, at_once=AT_ONCE if number else 1)
            rest()
            run.measure()
            say(f"round {number + 1}: {run.outcome.footprints[-1]}, {run.outcome.wrong}")
        slopes = {of: slope(run.outcome.footprints[1:], of) for of in SLOPES}
        told = asdict(run.outcome)
    told["pids"], told["slopes"] = len(told["pids"]), slopes
    return {
        **told,
        "families": {family: len(cases) for family, cases in FAMILIES.items()},
        "rounds": options.rounds,
        "is_wrong": any(told[flaw] for flaw in FLAWS),
    }


def yanks(root: Path, options: argparse.Namespace) -> Figures:
    """Yank a drive at `--points` moments."""

    async def run() -> Figures:
        async with bench(root) as made:
            told = await yank_all(made, options.points, seed=options.seed)
            return asdict(told)

    told = asyncio.run(run())
    wrong = told["stuck_mounts"] or told["left_over"] or told["disturbed"]
    return {**told, "is_wrong": bool(wrong)}


def crowd(root: Path, options: argparse.Namespace) -> Figures:
    """Plug in a crowd."""
    with running(root / "host") as host:
        told = crowds.plug_all(host, crowds.make(root / "drives", CROWD), WITHIN_S)
    return {**asdict(told), "is_wrong": told.most_at_once > 2}


def soak(root: Path, options: argparse.Namespace) -> Figures:
    """Good and hostile drives by turns, two at a time, and a look at the daemon now and then."""
    hostile = [case for cases in FAMILIES.values() for case in cases[::11]][:TURNS]
    good = [HostileDrive(f"good-{number}", "", Bench.sound) for number in range(len(hostile))]
    with gauntlet(root) as run:
        drives = run.make([case for pair in zip(good, hostile, strict=True) for case in pair])
        while run.outcome.drives < options.cycles:
            run.round(drives, at_once=2)
            rest()
            run.measure()
            say(f"{run.outcome.drives} cycles: {run.outcome.footprints[-1]}, {run.outcome.wrong}")
        slopes = {of: slope(run.outcome.footprints, of) for of in SLOPES}
        told = asdict(run.outcome)
    told["pids"], told["slopes"] = len(told["pids"]), slopes
    return {**told, "is_wrong": any(told[flaw] for flaw in FLAWS)}


WHAT: Mapping[str, Callable[[Path, argparse.Namespace], Figures]] = {
    "hostile": hostile,
    "yanks": yanks,
    "crowd": crowd,
    "soak": soak,
}


def main() -> int:
    """Measure what is asked for, and write the page."""
    options = _options()
    work = Round(options.folder, list(WHAT), Limit(options.minutes))
    for name in work.due() if options.due else options.what:
        with tempfile.TemporaryDirectory(prefix=f"nondum-{name}-") as root:
            figures = WHAT[name](Path(root), options)
        figures["machine"] = _machine()
        (options.folder / f"{name}.json").write_text(json.dumps(figures))
        work.add(name, passed=not figures["is_wrong"])
    found = {name: _read(options.folder / f"{name}.json") for name in WHAT}
    if not options.due:
        PAGE.write_text("\n".join(_page(found)) + "\n", encoding="utf-8")
    return any(figures and figures["is_wrong"] for figures in found.values())


def rest() -> None:
    """Give a daemon the time after which nothing is kept any more that can be had again."""
    time.sleep(QUIET_S + 2.0)


def say(line: str) -> None:
    """Tell how far it has come."""
    print(line, flush=True)  # noqa: T201  # a program for people


def _page(found: Mapping[str, Figures | None]) -> Iterator[str]:
    yield "# Drives: what was tried, and what it came to"
    yield ""
    shown_here = " ".join(name for name, figures in found.items() if figures is not None)
    left_out = ", ".join(f"`{name}`" for name, figures in found.items() if figures is None)
    yield f"Written by `python -m tests.faults.drive_figures {shown_here}`."
    if left_out:
        yield f"Not measured for this page: {left_out}."
    shown = {"hostile": _hostile, "yanks": _yanks, "crowd": _crowd, "soak": _soak}
    for name, show in shown.items():
        figures = found[name]
        if figures is not None:
            yield ""
            yield from show(figures)
            yield ""
            yield f"Machine: {figures['machine']}."


def _hostile(told: Figures) -> Iterator[str]:
    drives = sum(told["families"].values())
    late = sum(second > REFUSED_S for second in told["seconds"].values())
    seconds = sorted(told["seconds"].values())
    before, *rounds = told["footprints"]
    first, last = rounds[0], rounds[-1]
    yield "## Hostile drives"
    yield ""
    yield f"{drives} different drives, each {told['rounds']} times through one daemon that demands"
    yield "signatures: once alone, which is timed, then sixteen at a time; two benign payloads"
    yield "pursue a goal that must hold after each batch. All but those of the first family"
    yield "are signed by a key that the daemon trusts: what is wrong with them is reached."
    yield ""
    yield "| family | drives |"
    yield "|---|---|"
    for family, number in told["families"].items():
        yield f"| {family} | {number} |"
    yield ""
    yield "| | reached | aim |"
    yield "|---|---|---|"
    yield f"| drives told | {told['drives']} | {drives * told['rounds']} |"
    yield f"| told with another code than theirs | {len(told['wrong'])} | 0 |"
    yield f"| daemons that it took | {told['pids']} | 1 |"
    yield f"| told without what to do | {len(told['without_remedy'])} | 0 |"
    growth = last["rss_mb"] - before["rss_mb"]
    yield f"| memory of the daemon, from before until after all | {growth:+.1f} MB | +10 MB |"
    yield f"| the same, from the first round on | {_grown(first, last, 'rss_mb'):+.1f} MB | |"
    yield f"| descriptors, likewise | {_grown(before, last, 'descriptors'):+d} | 0 |"
    yield f"| canaries that ran | {told['canaries']} | 0 |"
    yield f"| files outside the state folder | {len(told['strays'])} | 0 |"
    yield f"| drives that were changed | {len(told['touched'])} | 0 |"
    yield f"| control characters in the log | {told['controls']} | 0 |"
    yield f"| told after, median (p95, longest) | {_spread(seconds)} | 2 s |"
    yield f"| told after more than 2 s | {late} of {len(seconds)} | 0 |"
    if told["wrong"]:
        yield ""
        yield "Told with another code: " + "; ".join(sorted(set(told["wrong"]))) + "."
    yield ""
    yield "At rest, before and after each round; the catalogue is that of a journal which keeps its"
    yield "last 20,000 entries."
    yield ""
    yield from _footprints(told["footprints"], told["slopes"])
    slow = sorted(told["seconds"].items(), key=lambda item: -item[1])[:8]
    yield ""
    shown = (f"{name} {second:.1f} s" for name, second in slow)
    yield f"Those that took longest: {', '.join(shown)}."


def _grown(before: Figures, after: Figures, of: str) -> Any:
    return after[of] - before[of]


def _footprints(rows: Sequence[Figures], slopes: Figures) -> Iterator[str]:
    """What a daemon took, look by look, and how fast that grew after the first round."""
    yield COLUMNS
    yield "|---" * (COLUMNS.count("|") - 1) + "|"
    for number, row in enumerate(rows):
        yield (
            f"| {number} | {row['rss_mb']:.1f} MB | {row['pss_mb']:.1f} MB | {row['descriptors']} "
            f"| {row['threads']} | {row['processes']} | {row['zombies']} | {row['mounts']} "
            f"| {row['files']} | {row['catalogue_mb']:.1f} MB |"
        )
    yield ""
    yield (
        f"Slopes: resident memory {slopes['rss_mb']:+.2f} MB an hour, its share "
        f"{slopes['pss_mb']:+.2f} MB an hour, descriptors {slopes['descriptors']:+.2f} an hour, "
        f"files {slopes['files']:+.2f} an hour."
    )


def _yanks(told: Figures) -> Iterator[str]:
    every = sorted(second for each in told["seconds"].values() for second in each)
    yield "## Yanked drives"
    yield ""
    yield f"{len(every)} times a loop device with a payload of 8 MB and more was attached and, at a"
    yield "moment drawn evenly from its coming until after it idled, its backing file cut off, the"
    yield "page cache dropped and its removal told by the kernel. The time is that until no row,"
    yield "process, mount and folder of it was left; the aim is 2 s for 95 in 100, and 5 s at most."
    yield ""
    yield "| while | yanks | median (p95, longest) |"
    yield "|---|---|---|"
    for phase in PHASES:
        seconds = sorted(told["seconds"][phase])
        yield f"| {WHILE[phase]} | {len(seconds)} | {_spread(seconds)} |"
    yield f"| all | {len(every)} | {_spread(every)} |"
    yield ""
    yield f"- mounts left over: {told['stuck_mounts']}"
    yield f"- folders and processes left over: {len(told['left_over'])}"
    if told["left_over"]:
        yield "  (seen at the moment that all was taken to be over; the next drive came once they"
        yield "  had gone)"
    yield f"- times that the benign payload beside it noticed: {told['disturbed']}"


WHILE = {
    "look": "it was mounted and looked through",
    "copy": "its payload was copied",
    "install": "its payload was checked and installed",
    "run": "its payload ran, and it had been let go",
}


def _crowd(told: Figures) -> Iterator[str]:
    yield "## A crowd of drives"
    yield ""
    yield f"{told['drives']} drives plugged in within {told['plugged_s']:.1f} s: in turn with"
    yield "a new payload, a copy of one and the same, one with a changed file, and without any."
    yield ""
    yield "| | reached | aim |"
    yield "|---|---|---|"
    yield f"| all over after | {told['over_s']:.1f} s | 300 s |"
    yield f"| active, refused, let go | {told['active']}, {told['refused']}, {told['let_go']} | |"
    yield f"| most memory of the daemon | {told['memory_mb']:.0f} MB | 200 MB |"
    yield f"| payloads brought in at the same time | {told['most_at_once']} | 2 |"
    yield f"| processes that read drives at the same time | {told['children']} | |"
    yield f"| drives and payloads that were shown as waiting | {told['queued']} | |"


def _soak(told: Figures) -> Iterator[str]:
    first, *_, last = told["footprints"]
    hours = (last["at_s"] - first["at_s"]) / 3600
    cycles = told["drives"] - told["drives"] / len(told["footprints"])
    growth = _grown(first, last, "rss_mb")
    yield "## Soak"
    yield ""
    yield f"{told['drives']} times a drive was plugged in, told or taken in, and pulled: good ones"
    yield "and hostile ones by turns, two at a time, through one daemon. It was looked at, at rest,"
    yield f"each {2 * TURNS} cycles, the first time after as many; from the first look to the last"
    yield f"were {hours * 60:.0f} minutes."
    yield ""
    yield "| | reached | aim |"
    yield "|---|---|---|"
    yield f"| told otherwise than they should be | {len(told['wrong'])} | 0 |"
    yield f"| daemons that it took | {told['pids']} | 1 |"
    yield f"| descriptors, first to last look | {_grown(first, last, 'descriptors'):+d} | 0 |"
    yield f"| resident memory, first to last look | {growth:+.1f} MB | |"
    paced = growth / cycles * CYCLES_AN_HOUR
    yield f"| the same, for each {CYCLES_AN_HOUR} cycles | {paced:+.2f} MB | 1 MB |"
    yield f"| canaries that ran | {told['canaries']} | 0 |"
    yield ""
    yield f"The aim is 1 MB an hour with 8,640 cycles a day, which are {CYCLES_AN_HOUR} an hour."
    yield "Until the last thousand sentences, SQLite's cache (2 MB) and the journal are full, some"
    yield "growth is meant: the rounds of hostile drives above go on for longer."
    yield ""
    yield from _footprints(told["footprints"], told["slopes"])


def _spread(ordered: Sequence[float]) -> str:
    if not ordered:
        return "-"
    p95 = ordered[min(len(ordered) - 1, int(len(ordered) * 0.95))]
    return f"{statistics.median(ordered):.2f} s ({p95:.2f}, {ordered[-1]:.2f})"


def _read(file: Path) -> Figures | None:
    return json.loads(file.read_text()) if file.exists() else None


def _machine() -> str:
    release = platform.release().partition("-")[0]
    return f"{platform.machine()}, Linux {release}, Python {platform.python_version()}"


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.faults.drive_figures",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", nargs="*", choices=[*WHAT, []], help="nothing: only the page")
    parser.add_argument("--due", action="store_true", help="what is not in the folder yet")
    parser.add_argument("--minutes", type=float, help="begin nothing more after so long")
    parser.add_argument("--rounds", type=int, default=10, help="of hostile drives")
    parser.add_argument("--points", type=int, default=500, help="yanks")
    parser.add_argument("--seed", type=int, default=11, help="by which their moments are drawn")
    parser.add_argument("--cycles", type=int, default=500, help="of the soak")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="what was measured so far")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
