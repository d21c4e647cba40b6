"""`python -m tests`: all tests in the order that CI runs them; with arguments, pytest with those.

Tests run beside each other, one more than there are processors, since most wait now and then.
Whole daemons (marker `daemon`) come after the rest. Those of them that are judged in real time
(`alone`) have the processors to themselves: another host beside them would be load that no robot
has. What they leave of the processors goes, at the lowest priority, to tests that only compute.
Each plugin's own tests run as its author runs them, in its folder.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parent.parent
PYTEST = [sys.executable, "-m", "pytest", "-q"]
# `.` on the path gives tests/ and demo/ only: nondum itself is what is installed.
INSTALLED = ["-o", "pythonpath=."]
SLOWEST = ["--durations", "20", "--durations-min", "5"]
PROCESSORS = os.cpu_count() or 1
COMPUTE = [
    "tests/benchmarks",
    "tests/demo/shuffle",
    "tests/demo/test_compton.py",
    "tests/demo/test_following_loop.py",
    "tests/docs",
    "tests/fuzz",
    "tests/host/catalogue",
    "tests/host/cli/test_bad_input.py",
    "tests/host/cli/test_config_commands.py",
    "tests/host/cli/test_main.py",
    "tests/host/cli/test_pddl.py",
    "tests/host/configuration",
    "tests/host/trust",
    "tests/mutation",
    "tests/packages",
    "tests/planning",
    "tests/plugins",
    "tests/wheelhouse",
]
"""Tests that nobody waits for in real time."""


def main(arguments: list[str]) -> int:
    """Run what was asked for; the worst exit status of all runs."""
    if arguments:
        command = [sys.executable, "-m", "pytest", *INSTALLED, *arguments]
        return subprocess.run(command, cwd=ROOT, check=False).returncode
    ignored = [f"--ignore={place}" for place in COMPUTE]
    statuses = [
        _run(*_at_once(PROCESSORS + 1), "-m", "not daemon", *ignored),
        _run(*_at_once(PROCESSORS + 1), "-m", "daemon and not alone"),
    ]
    with ThreadPoolExecutor(PROCESSORS) as pool:
        computing = pool.submit(_compute)
        statuses.append(_run("-m", "alone"))
        statuses.append(computing.result())
        folders = (folder.parent for folder in sorted(ROOT.glob("plugins/*/tests")))
        statuses += pool.map(_of_plugin, folders)
    return max(statuses)


def _at_once(number: int) -> list[str]:
    return ["-n", str(number), "--dist", "loadfile", "--no-loadscope-reorder"]


def _run(*options: str) -> int:
    command = [*PYTEST, *INSTALLED, *SLOWEST, *options]
    return subprocess.run(command, cwd=ROOT, check=False).returncode


def _compute() -> int:
    options = [*INSTALLED, *SLOWEST, *_at_once(PROCESSORS), "-m", "not daemon", *COMPUTE]
    return _shown_when_over(ROOT, ["nice", "-n", "19", *PYTEST, *options])


def _of_plugin(folder: Path) -> int:
    return _shown_when_over(folder, PYTEST)


def _shown_when_over(folder: Path, command: Sequence[str]) -> int:
    """Run beside something else that writes."""
    pipe = subprocess.PIPE
    done = subprocess.run(command, cwd=folder, stdout=pipe, stderr=subprocess.STDOUT, text=True)
    sys.stdout.write(f"{folder.name}\n{done.stdout}")
    return done.returncode


if __name__ == "__main__":
    # A shell starts what runs in the background deaf to Ctrl-C; some tests press it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.exit(main(sys.argv[1:]))
