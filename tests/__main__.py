"""`python -m tests`: all tests in the order that CI runs them; with arguments, pytest with those.

Whole hosts (marker `lab`) run after the rest. Those that are judged in real time run by themselves:
other tests beside them would be load that no robot has; two of the others (`beside`) run at once.
Each plugin's own tests run as its author runs them, in its folder, two plugins at once.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parent.parent
PYTEST = [sys.executable, "-m", "pytest"]
# `.` on the path gives tests/ and demo/ only: nondum itself is what is installed.
INSTALLED = ["-o", "pythonpath=."]
SLOWEST = ["--durations", "20", "--durations-min", "5"]
TWO_AT_ONCE = ["-n", "2", "--dist", "loadfile"]


def main(arguments: list[str]) -> int:
    """Run what was asked for; the worst exit status of all runs."""
    if arguments:
        return subprocess.run([*PYTEST, *INSTALLED, *arguments], cwd=ROOT, check=False).returncode
    runs = (
        [*TWO_AT_ONCE, "-m", "not lab"],
        [*TWO_AT_ONCE, "-m", "beside"],
        ["-m", "lab and not beside"],
    )
    statuses = [_run(ROOT, [*INSTALLED, *SLOWEST, *options]) for options in runs]
    with ThreadPoolExecutor(max_workers=2) as two_at_once:
        folders = (folder.parent for folder in sorted(ROOT.glob("plugins/*/tests")))
        statuses += two_at_once.map(_of_plugin, folders)
    return max(statuses)


def _run(folder: Path, options: Sequence[str]) -> int:
    return subprocess.run([*PYTEST, "-q", *options], cwd=folder, check=False).returncode


def _of_plugin(folder: Path) -> int:
    """Run a plugin's own tests; what they write is shown when they are over."""
    done = subprocess.run(
        [*PYTEST, "-q"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    sys.stdout.write(f"{folder.name}\n{done.stdout}")
    return done.returncode


if __name__ == "__main__":
    # A shell starts what runs in the background deaf to Ctrl-C; some tests press it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.exit(main(sys.argv[1:]))
