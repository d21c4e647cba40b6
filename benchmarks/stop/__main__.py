"""How quickly a robot is stopped: `python -m benchmarks.stop`, from the root of the checkout.

Takes what the demonstrations take (`./run demo`), and PYTHONPATH=plugins/espeak:plugins/speech.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from benchmarks.recompose.processes import await_calm
from benchmarks.stop import acting, hearing, report
from benchmarks.stop.results import Hearing, Results, Way
from demo.robot import Robot

PAGE = Path(__file__).parents[2] / "docs/benchmarks/stop.md"
METHOD = Path(__file__).with_name("method.md")
SCENES = {"first": acting.first, "second": acting.second}
PARTS = (*SCENES, "spoken")
CALM_S = 30.0


def main() -> None:
    """Stop, hear, print the tables, and write the page."""
    chosen = _arguments()
    Robot.slowness = chosen.slowness
    calm: list[bool] = []
    ways: list[Way] = []
    hearings: list[Hearing] = []
    for part in chosen.part or PARTS:
        calm.append(await_calm(timeout_s=chosen.calm_s))
        if part == "spoken":
            hearings += hearing.run(chosen.voices, chosen.sentences, _say)
            continue
        with (
            tempfile.TemporaryDirectory(prefix="nondum-stop-", ignore_cleanup_errors=True) as work,
            SCENES[part](Path(work)) as scene,
        ):
            ways += acting.measured(scene, chosen.rounds, _say)
    notes = tuple(chosen.note)
    found = Results(chosen.rounds, tuple(calm), tuple(ways), tuple(hearings), notes)
    tables = report.as_markdown(found)
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    chosen.out.write_text(f"{METHOD.read_text(encoding='utf-8')}\n{tables}", encoding="utf-8")
    print(tables)
    _say(f"written to {chosen.out}")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=20, help="stops of each way [20]")
    parser.add_argument("--voices", type=int, default=12, help="voices that say each sentence [12]")
    parser.add_argument(
        "--sentences", type=int, help="how many of the sentences that stop nothing [all]"
    )
    parser.add_argument("--part", action="append", choices=PARTS, help="only this; repeatable")
    parser.add_argument("--out", type=Path, default=PAGE, help="the page to write")
    parser.add_argument(
        "--slowness", type=float, default=1.0, help="how much longer to wait, on a busy machine [1]"
    )
    parser.add_argument("--note", action="append", default=[], help="a line about the machine")
    parser.add_argument(
        "--calm-s", type=float, default=CALM_S, help="how long a calm machine is waited for [30]"
    )
    return parser.parse_args()


def _say(text: str) -> None:
    print(f"stop: {text}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
