"""The long form of the tests of faults: `python -m tests.faults --minutes N`.

Works off what was not done yet of each kind in turn, and adds to the results in a folder, so that
it can be stopped and goes on where it was. `--points` limits their number for each kind, and
`--seed` draws them. `--table` writes docs/reliability/faults.md from the results; without
`--minutes` it does nothing else.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import itertools
import json
import platform
import random
import shutil
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import asdict
from functools import partial
from pathlib import Path

from tests.campaign.progress import Limit, Progress
from tests.faults import points, power, table
from tests.faults.points import Point, Result, clean
from tests.kit.fork_server import Nursery

FOLDER = Path("build/faults")
"""What was done so far; and what the points are made from, so that they stay what they are."""
BATCH = 24
"""Points of each kind in turn."""

FULL = {"boundary": 20, "kill": 2000, "moment": 1000, "error": 1500, "power": 1000}
"""What makes the campaign whole: of the first, times each row of the tables before and after."""

_nursery: Nursery | None = None
"""Of this process of the pool."""


def main() -> int:
    """Run what there is time for; 1 if anything was wrong."""
    options = _options()
    options.folder.mkdir(parents=True, exist_ok=True)
    if options.minutes is not None or options.table is None:
        with contextlib.suppress(KeyboardInterrupt):
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
    limit = Limit(options.minutes)
    results = options.folder / "results.jsonl"
    found = {(r.kind, r.name): r for r in read(results) if not (r.wrong and options.again)}
    planned = _planned(options, _prepared(options.folder))
    total = sum(map(len, planned.values()))
    left = {
        kind: iter([point for point in points if (kind, point.name) not in found])
        for kind, points in planned.items()
    }

    def kept() -> Progress:
        names = [f"{kind} {name}" for kind, name in found]
        wrong = [f"{r.kind} {r.name}" for r in found.values() if r.wrong]
        progress = Progress(total, tuple(names), tuple(wrong))
        progress.write(options.folder)
        return progress

    kept()
    with ProcessPoolExecutor(options.jobs) as pool, results.open("a") as out:
        while left and not limit.is_over:
            for kind, points_left in list(left.items()):
                if limit.is_over:
                    break
                batch = list(itertools.islice(points_left, BATCH))
                if not batch:
                    del left[kind]
                tried = [pool.submit(_try, point, options.folder) for point in batch]
                for result in _results(pool, tried, limit):
                    found[result.kind, result.name] = result
                    out.write(json.dumps(asdict(result)) + "\n")
                    out.flush()
                    mark = "WRONG" if result.wrong else "ok"
                    _say(f"{limit} {kept()}  {kind} {result.name}: {result.outcome} {mark}")


def _results(
    pool: ProcessPoolExecutor, tried: Sequence[Future[Result]], limit: Limit
) -> Iterator[Result]:
    """As they come. When the time is over, only of what has begun."""
    try:
        for ended in as_completed(tried):
            if not ended.cancelled():
                yield ended.result()
            if limit.is_over:
                for one in tried:
                    one.cancel()
    except KeyboardInterrupt:
        pool.shutdown(wait=False, cancel_futures=True)
        raise


def _planned(options: argparse.Namespace, counts: dict[str, int]) -> dict[str, list[Point]]:
    """The points of each kind: all in their order, or `--points` of them, drawn by `--seed`."""
    return {
        kind: list(itertools.islice(_drawn(kind, counts, options.seed), options.points))
        for kind in options.kinds
    }


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


def _drawn(kind: str, counts: dict[str, int], seed: int | None) -> Iterator[Point]:
    more = {} if seed is None else {"seed": seed}
    every: dict[str, Callable[[], Iterator[Point]]] = {
        "boundary": partial(_boundaries, seed),
        "moment": partial(points.moments, FULL["moment"], **more),
        "kill": partial(points.calls, "kill", counts, FULL["kill"], **more),
        "error": partial(points.calls, "error", counts, FULL["error"], **more),
        "power": partial(_failures, more),
    }
    return every[kind]()


def _boundaries(seed: int | None) -> Iterator[Point]:
    """Each row once before any row comes again."""
    every = points.boundaries(FULL["boundary"])
    rows = list(itertools.islice(every, len(list(points.boundaries(1)))))
    if seed is not None:
        random.Random(seed).shuffle(rows)
    return itertools.chain(rows, every)


def _failures(more: dict[str, int]) -> Iterator[Point]:
    for nth in range(FULL["power"]):
        yield Point("power", str(nth), {"nth": nth, **more})


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
    drawn = power.cuts(life, nth + 1, point.arguments.get("seed", 5))
    after, seed = next(itertools.islice(drawn, nth, None))
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
    release = platform.release().partition("-")[0]
    return f"{platform.machine()}, Linux {release}, Python {platform.python_version()}"


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__)
    parser.add_argument("--minutes", type=float, help="how long to go on [until all is done]")
    parser.add_argument("--points", type=int, help="of each kind [all]")
    parser.add_argument("--seed", type=int, help="by which points are drawn [a fixed order]")
    parser.add_argument("--jobs", type=int, default=2, help="points at the same time")
    parser.add_argument("--kinds", nargs="+", choices=list(FULL), default=list(FULL))
    parser.add_argument("--folder", type=Path, default=FOLDER, help="what was done so far")
    parser.add_argument("--again", action="store_true", help="do again what went wrong")
    parser.add_argument("--table", type=Path, help="write the page of figures there")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
