"""The command: `python -m benchmarks.execution`, from the root of the checkout."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks.execution import report, ticking
from benchmarks.execution.planner import Planner
from benchmarks.execution.results import Cell, Results
from benchmarks.execution.scenes import NAMES, scene
from benchmarks.execution.trial import EXECUTORS, run
from benchmarks.execution.troubles import KINDS

PAGE = Path(__file__).parents[2] / "docs/benchmarks/execution.md"
METHOD = Path(__file__).with_name("method.md")


def main() -> None:
    """Simulate, print the tables, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=30, help="runs of each executor [30]")
    parser.add_argument("--out", type=Path, default=PAGE, help="the page to write")
    chosen = parser.parse_args()
    found = Results(tuple(cell for name in NAMES for cell in cells(name, chosen.seeds)))
    tables = report.as_markdown(found, ticking.measured(), chosen.seeds)
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    chosen.out.write_text(f"{METHOD.read_text(encoding='utf-8')}\n{tables}", encoding="utf-8")
    print(tables)
    print(f"execution: written to {chosen.out}", file=sys.stderr)


def cells(name: str, seeds: int) -> list[Cell]:
    """All runs in one scene: the executors take turns, seed by seed, each meets the same fates."""
    place = scene(name)
    planner = Planner(place)
    print(f"execution: {name}", file=sys.stderr)
    found = []
    for trouble, rates in KINDS.items():
        runs = [
            [run(place, planner, make, rates, seed) for make in EXECUTORS.values()]
            for seed in range(seeds)
        ]
        by_executor = zip(EXECUTORS, zip(*runs, strict=True), strict=True)
        found += [Cell(name, trouble, executor, outcomes) for executor, outcomes in by_executor]
    return found


if __name__ == "__main__":
    main()
