"""What a full run consists of: which jobs, in which order, and which of them beside each other.

Tests run beside each other, two for each processor, since most wait half of their time; an emulated
machine and the plugins' own tests run beside them. The demonstrations (marker `alone`) are judged
in real time, as a person would: no other whole daemon runs meanwhile, and what only computes does
so at a lower priority.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from tests.runner.job import Job

ROOT = Path(__file__).parents[2]
PROCESSORS = os.cpu_count() or 1
INSTALLED = ("-o", "pythonpath=. packaging/development")
"""These give tests/, demo/ and nondum_dev only: nondum itself is what is installed."""
COMPUTE = (
    "tests/benchmarks",
    "tests/demo/shuffle",
    "tests/demo/test_compton.py",
    "tests/demo/test_following_loop.py",
    "tests/docs",
    "tests/fuzz",
    "tests/cli/test_bad_input.py",
    "tests/cli/test_main.py",
    "tests/cli/test_pddl.py",
    "tests/mutation",
    "tests/planning",
    "tests/plugins",
    "tests/wheelhouse",
)
"""Tests that only compute: they run with what the demonstrations leave of the processors."""
LOWER = 5
"""Niceness of what computes beside the demonstrations: a third of their weight. With the lowest one
it got next to nothing on a machine with other work, and tests ended by their time limit."""
WITH_EXAMPLES = (
    *("host", "planning", "transport", "wheelhouse/nondum", "plugins/sdk/nondum", "demo"),
    "packaging/development/nondum_dev",
    *("benchmarks/recompose", "benchmarks/execution", "benchmarks/composition"),
)
"""Source with examples in its docstrings."""
NOT_SOURCE = ("*/template/*", "benchmarks/recompose/plugins/*")


def check_places(arguments: Iterable[str]) -> None:
    """Ends the run with status 2 if a test file or folder that is named is not there."""
    named = (word.split("::", 1)[0] for word in arguments if not word.startswith("-"))
    absent = [at for at in named if ("/" in at or at.endswith(".py")) and not (ROOT / at).exists()]
    if absent:
        print(f"no such file or folder: {', '.join(absent)}", file=sys.stderr)
        raise SystemExit(2)


def pytest_job(
    name: str,
    run: Path,
    options: Iterable[str],
    *,
    folder: Path = ROOT,
    prefix: str = "",
    niceness: int = 0,
) -> Job:
    """A pytest session whose folders, log and results lie in the folder of the run."""
    results = run / f"{name}.jsonl"
    command = (
        *(sys.executable, "-m", "pytest", "-q", "--basetemp", str(run / name)),
        *("-p", "tests.runner.plugin", f"--results={results}", *options),
    )
    log = run / f"{name}.log"
    more = {"PYTHONPATH": str(ROOT)} if folder != ROOT else {}
    return Job(name, command, folder, log, results, prefix, niceness, more)


def at_once(number: int) -> tuple[str, ...]:
    """`number` processes of pytest-xdist, each with whole files: one set of fixtures per file."""
    return ("-n", str(number), "--dist", "loadfile", "--no-loadscope-reorder")


def of_examples(run: Path) -> Job:
    """The examples in docstrings."""
    ignored = (f"--ignore-glob={pattern}" for pattern in NOT_SOURCE)
    return pytest_job("examples", run, ("--doctest-modules", *ignored, *WITH_EXAMPLES))


def beside_all(run: Path, options: Sequence[str], tox: Sequence[str]) -> tuple[list[Job], ...]:
    """Lanes: what is judged in no real time; an emulated machine, and the plugins.

    `tox` adds lint, type checks and the emulated machine, which have their own environments.
    """

    def env(name: str) -> Job:
        command = (*tox, "run", "-q", "-e", name, "--skip-pkg-install")
        return Job(name, command, ROOT, run / f"{name}.log")

    checks = [env("lint"), env("type")] if tox else []
    # As urgent as the tests beside it: else it would begin when they are over.
    urgent = {"NONDUM_LAB_NICE": "0"}
    command = ("./run", "lab", "--short")
    lab = [Job("lab", command, ROOT, run / "lab.log", more=urgent)] if tox else []
    return [*checks, of_examples(run), of_hosts(run, options)], [*lab, *of_plugins(run)]


def of_hosts(run: Path, options: Sequence[str]) -> Job:
    """All that is neither alone nor of what only computes."""
    ignored = (f"--ignore={place}" for place in COMPUTE)
    chosen = (*INSTALLED, *at_once(2 * PROCESSORS), "-m", "not alone", *ignored, *options)
    return pytest_job("hosts", run, chosen)


def of_demonstrations(run: Path, options: Sequence[str]) -> tuple[list[Job], ...]:
    """Lanes: what is judged in real time, and what computes meanwhile."""
    alone = pytest_job("alone", run, (*INSTALLED, "-m", "alone", "tests/demo", *options))
    chosen = (*INSTALLED, *at_once(PROCESSORS), *COMPUTE, *options)
    return [alone], [pytest_job("compute", run, chosen, niceness=LOWER)]


def of_plugins(run: Path) -> Iterable[Job]:
    """Each plugin's own tests, as its author runs them; their names are paths from its folder."""
    for tests in sorted(ROOT.glob("plugins/*/tests")):
        folder = tests.parent
        prefix = f"{folder.relative_to(ROOT)}/"
        yield pytest_job(folder.name, run, ("--rootdir", "."), folder=folder, prefix=prefix)
