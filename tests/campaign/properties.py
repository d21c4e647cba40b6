"""Tests of properties with many examples: `python -m tests.campaign.properties --minutes N`.

Hypothesis draws a thousand examples where a test does not ask for a number, other ones for each
seed. Each file with such tests is a piece of the round; its tests run once for each of some seeds.
As many files as there are processors run at the same time: they compute, and are not timed.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.campaign import suites
from tests.campaign.progress import Limit, Round, work_off

SEEDS = 3
"""A test that asks for a number of examples gets as many for each of these."""


def main(words: Sequence[str]) -> int:
    """Run what there is time for; 1 if anything failed."""
    options = _options(words)
    only = ["-p", "tests.campaign.only_properties", "--hypothesis-profile=campaign"]
    work = Round(options.folder, suites.files_of(only), Limit(options.minutes))
    seeds = [f"--hypothesis-seed={n}" for n in range(options.seed, options.seed + SEEDS)]

    def try_seeds(_: int, file: str) -> None:
        for seed in seeds:
            chosen = [*only, seed, "--timeout=1800"]
            passed, note = suites.run_file(work.folder, file, chosen)
            if not passed:
                break
        work.add(file, passed=passed, note=note)

    work_off(work.due(), os.cpu_count() or 1, try_seeds)
    return work.end()


def _options(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.campaign.properties", description=__doc__)
    parser.add_argument("--minutes", type=float, help="how long to go on [until all is done]")
    parser.add_argument("--folder", type=Path, help="what was done so far")
    parser.add_argument("--seed", type=int, default=1, help="the first seed")
    options = parser.parse_args(words)
    options.folder = options.folder or suites.ROOT / "build/campaigns/properties/round"
    return options


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
