"""The page docs/benchmarks/footprint.md, of all that is kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.footprint.results import Footprint, kept

PAGE = Path(__file__).parents[2] / "docs/benchmarks/footprint.md"
METHOD = Path(__file__).with_name("method.md")
Shown = Callable[[Footprint], str]
ROWS: Sequence[tuple[str, str, Shown]] = (
    ("memory of the idle daemon", "≤ 60 MB", lambda f: f"{f.daemon_mb:.1f} MB"),
    ("… of an interpreter with its packages alone", "", lambda f: _mb(f.packages_mb)),
    ("a worker, its plugin importing nothing", "≤ 20 MB", lambda f: f"{f.worker_mb:.1f} MB"),
    ("a worker's init (process 1 of its sandbox)", "", lambda f: f"{f.mb_of('init'):.1f} MB"),
    ("the spare worker", "", lambda f: f"{f.mb_of('worker'):.1f} MB"),
    ("planners, all of them", "", lambda f: f"{f.mb_of('planner'):.1f} MB"),
    ("a child for drives, waiting", "", lambda f: f"{f.mb_of('drive child'):.1f} MB"),
    ("all of it", "≤ 100 MB", lambda f: f"{f.all_mb:.1f} MB"),
    ("the links to peers, in a separate process", "", lambda f: _mb(f.apart_mb("links"))),
    ("… and the idle daemon then", "≤ 60 MB", lambda f: _mb(f.apart_mb("daemon"))),
    ("processor at idle, the daemon", "≤ 1 %", lambda f: f"{f.idle['cpu_percent']:.2f} %"),
    ("processor at idle, all", "", lambda f: f"{f.idle['cpu_percent_all']:.2f} %"),
    ("wake-ups at idle, the daemon", "", lambda f: f"{f.idle['wakeups_per_s']:.1f} a second"),
    (
        *("written at idle, nondum", "small"),
        lambda f: f"{f.idle['kb_written_per_hour']:.0f} kB an hour",
    ),
    ("start to ready", "≤ 3 s on an A72", lambda f: f"{f.start_s:.1f} s"),
    ("… of it, on a processor", "", lambda f: f"{f.start_cpu_s:.1f} s"),
    (
        "… in yardsticks",
        "",
        lambda f: f"{f.start_cpu_s / f.yardstick_s:.1f} of {f.yardstick_s:.2f} s",
    ),
)


def _mb(megabytes: float | None) -> str:
    return "not measured" if megabytes is None else f"{megabytes:.1f} MB"


def write() -> str:
    """Write the page; answers its table."""
    found = kept()
    PAGE.write_text(page(found), encoding="utf-8")
    return _table(found)


def page(found: Sequence[Footprint]) -> str:
    """The whole page."""
    return f"{METHOD.read_text(encoding='utf-8')}\n{_table(found)}"


def _table(found: Sequence[Footprint]) -> str:
    head = ["", "aim", *(f.machine for f in found)]
    lines = [head, ["---"] * len(head)]
    lines += [[what, aim, *map(shown, found)] for what, aim, shown in ROWS]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
