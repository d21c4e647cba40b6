"""The command: `python -m benchmarks.recompose`, from the root of the checkout."""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from benchmarks.recompose import machine, measuring, needs, payloads, report
from benchmarks.recompose.results import Results

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/benchmarks/recompose.md"
METHOD = Path(__file__).with_name("method.md")


def main() -> None:
    """Measure, print the tables, and write the page."""
    chosen = _arguments()
    chosen.work.mkdir(parents=True, exist_ok=True)
    work = chosen.work.resolve()
    carried = _carried(chosen, work)
    missing = needs.lacking(needs.TO_RUN if chosen.prepared else needs.TO_BUILD)
    if missing:
        _say(f"no container will be measured: {missing}")
    half = None if missing else measuring.containers(carried, work, _say)
    if chosen.prepare:
        return
    try:
        found = measuring.measure(carried, half, chosen.rounds, work, _say)
    finally:
        shutil.rmtree(work / "host", ignore_errors=True)
    calm = [is_calm for findings in found for is_calm in findings.calm]
    load = f"{sum(calm)} of {len(calm)} measurements began on a calm machine"
    told = (*chosen.note, *machine.describe(work), f"{chosen.rounds} rounds; {load}")
    tables = report.as_markdown(Results(told, found, missing))
    chosen.output.parent.mkdir(parents=True, exist_ok=True)
    chosen.output.write_text(f"{METHOD.read_text(encoding='utf-8')}\n{tables}", encoding="utf-8")
    print(tables)
    _say(f"written to {chosen.output}")


def _carried(chosen: argparse.Namespace, work: Path) -> tuple[payloads.Carried, ...]:
    names = chosen.payload or list(payloads.CONTENT)
    if chosen.prepared:
        return tuple(payloads.prepared(names, work))
    _say("building the payloads")
    return tuple(payloads.built(names, work))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7, help="how often each way is taken [7]")
    parser.add_argument(
        "--payload", action="append", choices=payloads.CONTENT, help="only these; repeatable"
    )
    parser.add_argument("--output", type=Path, default=PAGE, help="the page to write")
    parser.add_argument(
        "--work", type=Path, default=ROOT / "build/benchmarks/recompose", help="scratch folder"
    )
    parser.add_argument("--note", action="append", default=[], help="a line about the machine")
    parser.add_argument(
        "--prepare", action="store_true", help="only build what is measured, in the scratch folder"
    )
    parser.add_argument(
        "--prepared", action="store_true", help="measure what is there built, without a network"
    )
    return parser.parse_args()


def _say(text: str) -> None:
    print(f"recompose: {text}", file=sys.stderr)


if __name__ == "__main__":
    main()
