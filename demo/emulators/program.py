"""The emulators as programs: their arguments, and a clock that ends with the parent process."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from demo.scenario import Scenario


@dataclass(frozen=True, slots=True)
class Arguments:
    scenario: Scenario
    log: Path | None
    parent: int
    """The process that started this one, read before it can be told of anything to wait for."""


def arguments(about: str) -> Arguments:
    """The command line of an emulator: `--scenario FILE [--log FILE]`."""
    parent = os.getppid()
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--scenario", type=Path, required=True, help="the truth, as JSON")
    parser.add_argument("--log", type=Path, help="what really happened, as JSON lines")
    given = parser.parse_args()
    return Arguments(Scenario.read(given.scenario), given.log, parent)


def ticks(period_s: float, parent: int) -> Iterator[float]:
    """Yield how long to wait for input at every turn, for as long as process `parent` lives.

    Turns are `period_s` of the monotonic clock apart on average, however long the work takes.
    """
    due = time.monotonic()
    while os.getppid() == parent:
        due += period_s
        yield max(0.0, due - time.monotonic())
