"""The long form of the tests of faults: `python -m tests.faults --minutes N`.

Works off what was not done yet of each kind in turn, and adds to the results in a folder, so that
it can be stopped and goes on where it was. `--table` writes docs/reliability/faults.md from them.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import json
import platform
import shutil
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from functools import partial
from pathlib import Path

from tests.faults import points, power, table
from tests.faults.points import Point, Result, clean
from tests.kit.fork_server import Nursery

FOLDER = Path("build/faults")
"""What was done so far; and what the points are made from, so that they stay what they are."""
BATCH = 24
"""So many of each kind in turn."""

FULL = {"boundary": 20, "kill": 2000, "moment": 1000, "error": 1500, "power": 1000}
"""What makes the campaign whole: of the first, times each row of the tables before and after."""

_nursery: Nursery | None = None
"""Of this process of the pool."""


def main() -> int:
    """Run what there is time for; 1 if anything was wrong."""
    options = _options()
    options.folder.mkdir(parents=True, exist_ok=True)
    if options.minutes:
        _run(options)
    found = read(options.folder / "results.jsonl")
    if options.table:
        options.table.parent.mkdir(parents=True, exist_ok=True)
        options.table.write_text(table.page(found, FULL, _machine()), encoding="utf-8")
    wrong = [result for result in found if result.wrong]
    for result in wrong:
        _say(f"WRONG {result.kind} {result.name}: {result.wrong}")
    _say(f"{len(found)} points, {len(wrong)} wrong")
    return bool(wrong)


def read(file: Path) -> list[Result]:
    """All results so far; of a point that was done again, the last."""
    found: dict[tuple[str, str], Result] = {}
    if file.exists():
        for line in file.read_text().splitlines():
            said = json.loads(line)
            lists = {"wrong": tuple(said["wrong"]), "codes": tuple(said["codes"])}
            result = Result(**{**said, **lists})
            found[result.kind, result.name] = result
    return list(found.values())


def _run(options: argparse.Namespace) -> None:
    end = time.monotonic() + options.minutes * 60
    results = options.folder / "results.jsonl"
    done = {(r.kind, r.name) for r in read(results) if not (r.wrong and options.again)}
    counts = _prepared(options.folder)
    todo = {kind: _todo(kind, counts, done) for kind in options.kinds}
    number = len(done)
    with ProcessPoolExecutor(options.jobs) as pool, results.open("a") as out:
        while todo and time.monotonic() < end:
            for kind, left in list(todo.items()):
                batch = list(itertools.islice(left, BATCH))
                if not batch:
                    del todo[kind]
                tried = [pool.submit(_try, point, options.folder) for point in batch]
                for ended in as_completed(tried):
                    result = ended.result()
                    number += 1
                    out.write(json.dumps(asdict(result)) + "\n")
                    out.flush()
                    mark = "WRONG" if result.wrong else "ok"
                    _say(f"{number} {kind} {result.name}: {result.outcome} {mark}")
                if time.monotonic() >= end:
                    return


def _prepared(folder: Path) -> dict[str, int]:
    """How often each call is made, and a life to be cut short: found out once."""
    counts, life = folder / "calls.json", folder / "life"
    with Nursery() as nursery, tempfile.TemporaryDirectory(dir=_fast()) as fast:
        if not counts.exists():
            root = Path(fast) / "count"
            root.mkdir()
            counts.write_text(json.dumps(points.counted(nursery, root)))
        if power.lived(life) is None:
            shutil.rmtree(life, ignore_errors=True)
            life.mkdir()
            power.live(nursery, life.resolve())
    found: dict[str, int] = json.loads(counts.read_text())
    return found


def _todo(kind: str, counts: dict[str, int], done: set[tuple[str, str]]) -> Iterator[Point]:
    every: dict[str, Callable[[], Iterator[Point]]] = {
        "boundary": partial(points.boundaries, FULL["boundary"]),
        "moment": partial(points.moments, FULL["moment"]),
        "kill": partial(points.calls, "kill", counts, FULL["kill"]),
        "error": partial(points.calls, "error", counts, FULL["error"]),
        "power": _failures,
    }
    return (point for point in every[kind]() if (point.kind, point.name) not in done)


def _failures() -> Iterator[Point]:
    for nth in range(FULL["power"]):
        yield Point("power", str(nth), {"nth": nth})


def _try(point: Point, home: Path) -> Result:
    """In a process of the pool."""
    global _nursery
    if _nursery is None:
        _nursery = Nursery().__enter__()
    with tempfile.TemporaryDirectory(prefix="faults-", dir=_fast()) as fast:
        folder = Path(fast) / "point"
        folder.mkdir()
        try:
            if point.kind == "power":
                return _power(point, home, folder)
            return point.run(_nursery, folder)
        except Exception:
            _nursery.__exit__(None, None, None)
            _nursery = None
            return Result(point.kind, point.name, "broken", (traceback.format_exc()[-600:],))
        finally:
            clean(folder)


def _power(point: Point, home: Path, folder: Path) -> Result:
    life = _life(home / "life")
    nth = point.arguments["nth"]
    after, seed = next(itertools.islice(power.cuts(life, nth + 1), nth, None))
    ended = power.fail(life, after, seed, folder)
    outcome = f"{'all' if seed is None else 'part'} of what was not flushed"
    wrong = (*ended.wrong, *points.out_of_place(ended))
    return Result("power", point.name, outcome, wrong, ended.codes, ended.restart_s)


@functools.cache
def _life(folder: Path) -> power.Life:
    found = power.lived(folder.resolve())
    assert found is not None
    return found


def _say(line: str) -> None:
    print(line, flush=True)  # noqa: T201  # a program for people


def _fast() -> str | None:
    return "/dev/shm" if Path("/dev/shm").is_dir() else None


def _machine() -> str:
    return f"{platform.machine()}, Linux {platform.release()}, Python {platform.python_version()}"


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__)
    parser.add_argument("--minutes", type=float, default=0.0, help="how long to go on")
    parser.add_argument("--jobs", type=int, default=2, help="points at the same time")
    parser.add_argument("--kinds", nargs="+", choices=list(FULL), default=list(FULL))
    parser.add_argument("--folder", type=Path, default=FOLDER, help="what was done so far")
    parser.add_argument("--again", action="store_true", help="do again what went wrong")
    parser.add_argument("--table", type=Path, help="write the page of figures there")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
