"""Fuzz every reader, guided by coverage: `python -m tests.fuzz [TARGET…] [--cases N]`.

Needs atheris (`pip install --group fuzz`). Each target runs in a process of its own, as many at a
time as there are cores; what it finds is written to a file beside the report.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

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
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        running = {
            pool.submit(_fuzzed, t, options.cases or t.cases, options.work): t for t in chosen
        }
        done: dict[str, dict[str, Any]] = {}
        for future in as_completed(running):
            target = running[future]
            done[target.name] = future.result()
            told = ", ".join(f"{key} {value}" for key, value in done[target.name].items())
            sys.stdout.write(f"{target.name}: {told}\n")
    rows = [done[target.name] for target in chosen]
    if not options.targets:
        PAGE.parent.mkdir(exist_ok=True)
        PAGE.write_text(HEAD + "\n".join(_rows(chosen, rows)) + "\n", encoding="utf-8")
    return 1 if any(row["findings"] for row in rows) else 0


def _rows(targets: Sequence[Target], rows: Sequence[dict[str, Any]]) -> Iterator[str]:
    for target, row in zip(targets, rows, strict=True):
        yield (
            f"| {target.name} | {row['inputs']:,} | {row['findings']} | {row['codes']} | "
            f"{row['edges']:,} | {row['longest_ms']:.0f} ms | {row['grown_mb']:.0f} MB | "
            f"{row['seconds']:.0f} |"
        )


def _fuzzed(target: Target, cases: int, work: Path) -> dict[str, Any]:
    """Run a target until it has had its cases or breaks; what its process tells."""
    folder = work / target.name.replace(" ", "-").replace(",", "")
    folder.mkdir(parents=True, exist_ok=True)
    report = folder / "report.json"
    report.unlink(missing_ok=True)
    command = [sys.executable, "-m", "tests.fuzz.guided", target.name, str(cases), str(folder)]
    with (folder / "log").open("wb") as log:
        status = subprocess.run(command, stdout=log, stderr=log, check=False).returncode
    row: dict[str, Any] = json.loads(report.read_text()) if report.exists() else {}
    return {
        "inputs": row.get("inputs", 0),
        "findings": int(status != 0 or row.get("inputs", 0) < cases),
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
    parser.add_argument(
        "--work", type=Path, default=Path("/tmp/nondum-fuzz"), help="corpora, logs and findings"
    )
    options = parser.parse_args()
    if unknown := set(options.targets) - set(names):
        parser.error(f"no target is called {', '.join(sorted(unknown))}")
    return options


if __name__ == "__main__":
    sys.exit(main())
