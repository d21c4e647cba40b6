"""What both demonstrations do around their stages: a work folder, reports, an exit status."""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from demo import table
from demo.live import Says
from demo.robot import TooLate
from demo.table import StageResult


@dataclass(frozen=True, slots=True)
class Programme:
    """What is to be performed, and how its table reads."""

    stages: Sequence[str]
    """All that must be reached."""
    phases: Sequence[str]
    note: str


def perform(
    programme: Programme,
    play: Callable[[Path, Says], Iterator[StageResult]],
    options: argparse.Namespace,
    more: Mapping[str, Any],
) -> int:
    """Play the stages and report; 0 only if every one was reached. `more` goes into the JSON, as
    it is in the end."""
    say = Says(is_shown=not options.json)
    work = Path(tempfile.mkdtemp(prefix="nondum-demo-"))
    results: list[StageResult] = []
    is_over = False
    try:
        for result in play(work, say):
            results.append(result)
            say(f"  {result.measure}")
        is_over = True
    except TooLate as late:
        print(f"error: {late}", file=sys.stderr)
    finally:
        if options.keep:
            print(f"kept: {work}", file=sys.stderr)
        else:
            shutil.rmtree(work, ignore_errors=True)
    is_whole = is_over and tuple(result.name for result in results) == tuple(programme.stages)
    is_reached = is_whole and all(result.reached for result in results)
    if options.json:
        data = table.as_data(results, reached=is_reached, note=programme.note, **more)
        print(json.dumps(data, indent=2))
    else:
        print(table.as_text(results, phases=programme.phases, note=programme.note))
    return 0 if is_reached else 1


def parser(prog: str, description: str, **more: Any) -> argparse.ArgumentParser:
    """A parser with the options that both have; `more` is for `ArgumentParser`."""
    made = argparse.ArgumentParser(prog=prog, description=description, **more)
    made.add_argument("--json", action="store_true", help="print one JSON document, nothing else")
    made.add_argument("--plain", action="store_true", help="no live view, even on a terminal")
    made.add_argument("--keep", action="store_true", help="keep the work folder")
    return made
