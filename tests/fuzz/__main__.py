"""Fuzz every reader, guided by coverage: `python -m tests.fuzz [TARGET…] [--minutes N]`.

Needs atheris (`./run campaign fuzz` installs it). Each target runs in a separate process, as many
at a time as there are cores; what it finds is written to a file beside the report. With a folder
for what was done (`--folder`) it can be stopped and goes on where it was.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from tests.campaign.progress import Limit, Round
from tests.fuzz.target import Target
from tests.fuzz.targets import TARGETS

PAGE = Path(__file__).parents[2] / "docs/reliability/fuzzing.md"
HEAD = """\
# Readers and bytes that somebody else has made

Written by `python -m tests.fuzz`. Every reader of foreign bytes is given inputs that a
coverage-guided fuzzer (atheris, libFuzzer) makes from what nondum itself writes. Each input must be
read, or be refused with a code; anything else that is raised, more than a second of processor time
or 256 MB more of memory is a finding. *Codes* is how many different refusals were met, *reached*
how many edges of nondum's code were taken.

| reader | inputs | findings | codes | reached | longest | growth | seconds |
|---|---|---|---|---|---|---|---|
"""


_COVERED = re.compile(r" cov: (\d+)")
"""What libFuzzer tells of the edges that it has reached."""


def main() -> int:
    """Fuzz, report, and exit with 1 when something was found."""
    options = _options()
    chosen = [t for t in TARGETS if not options.targets or t.name in options.targets]
    with contextlib.ExitStack() as stack:
        if options.folder is None:
            fresh = tempfile.TemporaryDirectory(prefix="nondum-fuzz-")
            options.folder = Path(stack.enter_context(fresh))
        return _fuzz(chosen, options)


def _fuzz(chosen: Sequence[Target], options: argparse.Namespace) -> int:
    work = Round(options.folder, [target.name for target in chosen], Limit(options.minutes))
    due = [target for target in chosen if target.name in set(work.due())]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        turns = [pool.submit(_turn, target, options, work) for target in due]
        try:
            for turn in as_completed(turns):
                turn.result()
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            _end()
    if work.progress.is_whole and not options.targets:
        rows = [_read(options.folder, target) for target in chosen]
        PAGE.parent.mkdir(exist_ok=True)
        PAGE.write_text(HEAD + "\n".join(_rows(chosen, rows)) + "\n", encoding="utf-8")
    return work.end()


def _turn(target: Target, options: argparse.Namespace, work: Round) -> None:
    """Fuzz one target for what is left of the time, and add that to what was done before."""
    before, cases = _read(options.folder, target), options.cases or target.cases
    if work.limit.is_over:
        return
    seconds = 0 if work.limit.left_s is None else max(1, round(work.limit.left_s))
    row = _together(before, _fuzzed(target, cases - before["inputs"], options.work, seconds))
    _file(options.folder, target).write_text(json.dumps(row))
    if row["findings"] or row["inputs"] >= cases:
        told = ", ".join(f"{key} {value}" for key, value in row.items())
        work.add(target.name, passed=not row["findings"], note=told)
    else:
        sys.stdout.write(f"{work.limit} {target.name}: {row['inputs']:,} of {cases:,} inputs\n")
        sys.stdout.flush()


_running: set[subprocess.Popen[bytes]] = set()
_is_ending = threading.Event()


def _end() -> None:
    """Have the targets that run end: that is not their fault."""
    _is_ending.set()
    for process in tuple(_running):
        process.send_signal(signal.SIGINT)


NOTHING: dict[str, Any] = dict.fromkeys(
    ("inputs", "findings", "codes", "edges", "longest_ms", "grown_mb", "seconds"), 0
)
ADDED = ("inputs", "seconds")
"""What further turns add to; of the rest the most counts."""


def _together(one: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    return {
        key: one[key] + other[key] if key in ADDED else max(one[key], other[key]) for key in NOTHING
    }


def _file(folder: Path, target: Target) -> Path:
    return folder / f"{_folded(target.name)}.json"


def _read(folder: Path, target: Target) -> dict[str, Any]:
    """What was done of a target so far."""
    file = _file(folder, target)
    return json.loads(file.read_text()) if file.exists() else dict(NOTHING)


def _folded(name: str) -> str:
    return name.replace(" ", "-").replace(",", "")


def _rows(targets: Sequence[Target], rows: Sequence[dict[str, Any]]) -> Iterator[str]:
    for target, row in zip(targets, rows, strict=True):
        yield (
            f"| {target.name} | {row['inputs']:,} | {row['findings']} | {row['codes']} | "
            f"{row['edges']:,} | {row['longest_ms']:.0f} ms | {row['grown_mb']:.0f} MB | "
            f"{row['seconds']:.0f} |"
        )


def _fuzzed(target: Target, cases: int, work: Path, seconds: int) -> dict[str, Any]:
    """Run a target until it has had its cases or its time, or breaks; what its process tells."""
    folder = work / _folded(target.name)
    folder.mkdir(parents=True, exist_ok=True)
    report = folder / "report.json"
    report.unlink(missing_ok=True)
    words = [target.name, str(cases), str(folder), str(seconds)]
    command = [sys.executable, "-m", "tests.fuzz.guided", *words]
    with (
        (folder / "log").open("wb") as log,
        subprocess.Popen(command, stdout=log, stderr=log) as process,
    ):
        _running.add(process)
        status = process.wait()
        _running.discard(process)
    row: dict[str, Any] = json.loads(report.read_text()) if report.exists() else {}
    is_short = row.get("inputs", 0) < (1 if seconds else cases)
    return {
        "inputs": row.get("inputs", 0),
        "findings": int((status != 0 or is_short) and not _is_ending.is_set()),
        "codes": row.get("codes", 0),
        "edges": int((_COVERED.findall((folder / "log").read_text("utf-8", "replace")) or [0])[-1]),
        "longest_ms": row.get("longest_ms", 0.0),
        "grown_mb": row.get("grown_mb", 0.0),
        "seconds": row.get("seconds", 0.0),
    }


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.fuzz", description=__doc__)
    names = [target.name for target in TARGETS]
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"of {', '.join(names)}")
    parser.add_argument("--cases", type=int, help="inputs for each [default: as its target says]")
    parser.add_argument("--minutes", type=float, help="how long to go on [until all is done]")
    parser.add_argument("--folder", type=Path, help="what was done so far [begin again]")
    parser.add_argument(
        "--work", type=Path, default=Path("/tmp/nondum-fuzz"), help="corpora, logs and findings"
    )
    options = parser.parse_args()
    if unknown := set(options.targets) - set(names):
        parser.error(f"no target is called {', '.join(sorted(unknown))}")
    return options


if __name__ == "__main__":
    sys.exit(main())
