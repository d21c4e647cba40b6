"""Tests that are marked `long(NAME)`: `python -m tests.campaign.suites NAME --minutes N`.

Each file is a run of pytest and a piece of the round. What a file that failed has left (its log and
the folders of its failed tests) stays.
"""

from __future__ import annotations

import argparse
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import IO

from tests.campaign.progress import Limit, Round
from tests.campaign.registry import CAMPAIGNS

ROOT = Path(__file__).parents[2]
FAILED_RETENTION = ("-o", "tmp_path_retention_policy=failed")


def main(words: Sequence[str]) -> int:
    """Run what there is time for; 1 if anything failed."""
    options = _options(words)
    chosen = [f"--campaign={options.name}", f"--seed={options.seed}"]
    files = files_of(chosen)
    if not files:
        print(f"no test is marked long({options.name!r})")
        return 1
    return run(Round(options.folder, files, Limit(options.minutes)), chosen)


def run(work: Round, chosen: Sequence[str]) -> int:
    """Run files with options of pytest."""
    for file in work.due():
        passed, note = run_file(work.folder, file, chosen)
        work.add(file, passed=passed, note=note)
    return work.end()


def run_file(folder: Path, file: str, chosen: Sequence[str]) -> tuple[bool, str]:
    """Run one file: whether it passed, and pytest's last line, or where the evidence is."""
    log = folder / f"{file.replace('/', '-')}.log"
    # Sockets are made below it: the path must be short.
    base = Path(tempfile.mkdtemp(prefix="nondum-c-"))
    base.chmod(0o755)  # some tests are other users
    words = [*chosen, *FAILED_RETENTION, f"--basetemp={base / 't'}", file]
    with log.open("wb") as out:
        status = _pytest(words, out)
    last = log.read_text("utf-8", "replace").strip().splitlines()[-1:]
    if status == 0:
        shutil.rmtree(base, ignore_errors=True)
        return True, last[0] if last else ""
    return False, f"{log} {base}"


def files_of(chosen: Sequence[str]) -> list[str]:
    """The files of which pytest would run a test."""
    command = [sys.executable, "-m", "pytest", "-q", "--collect-only", *chosen]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    names = (line.partition("::")[0] for line in done.stdout.splitlines() if "::" in line)
    return list(dict.fromkeys(names))


def _pytest(words: Sequence[str], out: IO[bytes]) -> int:
    command = [sys.executable, "-m", "pytest", "-q", *words]
    with subprocess.Popen(command, cwd=ROOT, stdout=out, stderr=out) as process:
        try:
            return process.wait()
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            raise


def _options(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.campaign.suites", description=__doc__)
    names = [one.name for one in CAMPAIGNS.values() if one.is_pytest]
    parser.add_argument("name", choices=names)
    parser.add_argument("--minutes", type=float, help="how long to go on [until all is done]")
    parser.add_argument("--folder", type=Path, help="what was done so far")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn by lot")
    options = parser.parse_args(words)
    options.folder = options.folder or ROOT / "build/campaigns" / options.name / "round"
    return options


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
