"""The command: `python -m benchmarks.planning --domains DIR`, from the root of the checkout."""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from benchmarks.planning import report
from benchmarks.planning.contenders import installed
from benchmarks.planning.problems import Problem, problems_in
from benchmarks.planning.race import attempt
from benchmarks.planning.results import Attempt, Results

PAGE = Path(__file__).parents[2] / "docs/benchmarks/planning.md"
METHOD = Path(__file__).with_name("method.md")
DISTRIBUTIONS = ("pyperplan", "up-fast-downward")


def main() -> None:
    """Let everybody try everything, print the tables, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    folder = "folder of folders with PDDL, as `benchmarks.planning.draw` makes"
    parser.add_argument("--domains", type=Path, required=True, help=folder)
    parser.add_argument("--limit", type=float, default=10.0, help="seconds a problem [10]")
    parser.add_argument("--out", type=Path, default=PAGE, help="the page to write")
    parser.add_argument("--jobs", type=int, default=1, help="problems at once [1]")
    parser.add_argument("--only", default="", help="problems whose name contains this")
    chosen = parser.parse_args()
    problems = [one for one in problems_in(chosen.domains) if chosen.only in str(one)]
    if not problems:
        parser.error(f"there are no problems in {chosen.domains}")
    with ThreadPoolExecutor(chosen.jobs) as pool:
        tried = list(pool.map(lambda problem: attempts(problem, chosen.limit), problems))
    found = Results(tuple(one for some in tried for one in some))
    tables = report.as_markdown(found, chosen.limit, versions())
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    chosen.out.write_text(f"{METHOD.read_text(encoding='utf-8')}\n{tables}", encoding="utf-8")
    print(tables)
    print(f"planning: written to {chosen.out}", file=sys.stderr)


def attempts(problem: Problem, limit_s: float) -> list[Attempt]:
    """Everybody at one problem, one after the other."""
    found = []
    for contender in installed():
        one = attempt(problem, contender, limit_s)
        valid = "" if one.is_valid else ", INVALID"
        told = f"{one.said} ({one.steps} steps{valid})" if one.steps else one.said
        print(f"planning: {problem}: {contender}: {told}, {one.took_s:.2f} s", file=sys.stderr)
        found.append(one)
    return found


def versions() -> str:
    """What was measured against."""
    found = []
    for name in DISTRIBUTIONS:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} not installed")
    return ", ".join(found)


if __name__ == "__main__":
    main()
