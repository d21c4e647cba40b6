"""The full run: every behaviour once, in the order of `stages`, and a verdict that says why."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from tests.campaign import age
from tests.runner import budget, hardware, job, report, result, stages, unstable, yardstick
from tests.runner.job import Done, Job
from tests.runner.result import Result
from tests.runner.stages import PROCESSORS, ROOT
from tests.runner.unstable import Entry
from tests.runner.verdict import Findings
from tests.runner.yardstick import Usage


def run(tox: Sequence[str]) -> int:
    """Run everything; with `tox`, also the environments of tox. The exit status."""
    folder = evidence_folder()
    _print([f"what fails is kept in {folder}"])
    known, ages = budget.read(), age.ages(ROOT)
    slower = yardstick.measured_s(PROCESSORS) / known.yardstick_s
    before = Usage.now()

    options = (f"--current={','.join(one.campaign for one in ages if one.is_current)}",)
    done = job.beside(*stages.beside_all(folder, options, tox))
    done += job.beside(*stages.of_demonstrations(folder, options))
    after = Usage.now()
    others = yardstick.foreign_load(before, after, PROCESSORS)

    results = tuple(one for each in done for one in each.results)
    skipped = tuple(one for one in results if one.outcome == "skipped")
    unknown = hardware.unknown(skipped, hardware.read())
    found = Findings(
        results,
        died=tuple(one for one in done if one.failed_itself),
        passed_alone=tuple(passed_alone(done, folder)),
        folders=budget.spent(known, results, slower),
        is_judged=slower <= yardstick.SLOWER_BY and others <= yardstick.OTHERS,
        refused_skips=hardware.refused(skipped, hardware.read(), os.environ),
    )
    note(found.unstable)
    _print(report.slowest(results))
    _print(report.folders(found.folders, slower, others, is_judged=found.is_judged))
    _print(report.campaigns(ages))
    _print(report.skips(skipped, unknown, is_root=os.geteuid() == 0))
    _print([f"{(after.at_s - before.at_s) / 60:.1f} minutes on {PROCESSORS} processors"])
    _print(found.lines(folder))
    result.write(ROOT / "build/tests.jsonl", results)
    if found.is_green and not found.unstable:
        shutil.rmtree(folder, ignore_errors=True)
    return 0 if found.is_green else 1


def evidence_folder() -> Path:
    """One folder for all that a run leaves: short, since sockets lie in it (unix(7): 108 bytes)."""
    above = Path(tempfile.gettempdir()) / "nondum-tests"
    above.mkdir(exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix="", dir=above))
    for each in (above, folder):
        each.chmod(0o755)  # some tests are other users
    return folder


def passed_alone(done: Iterable[Done], folder: Path) -> Iterable[Result]:
    """Run each test that failed once more, alone; those that pass then.

    None is, if more failed than a run may forgive: then the machine or the change is to blame.
    """
    failed = [(each.job, one) for each in done for one in each.results if one.outcome == "failed"]
    if len(failed) > unstable.MOST:
        return
    for number, (of, one) in enumerate(failed, start=1):
        if job.run(_again(of, one, folder, number), shown=True).status == 0:
            yield one


def _again(of: Job, one: Result, folder: Path, number: int) -> Job:
    options = () if of.prefix else stages.INSTALLED
    test = one.test.removeprefix(of.prefix)
    name = f"again-{number}"
    return stages.pytest_job(name, folder, (*options, test), folder=of.folder, prefix=of.prefix)


def note(found: Sequence[Result]) -> None:
    """Name unstable tests on the page."""
    command = ("git", "rev-parse", "--short", "HEAD")
    commit = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout
    today = datetime.now(UTC).date().isoformat()
    unstable.add(unstable.PAGE, [Entry(r.test, today, commit.strip() or "unknown") for r in found])


def _print(lines: Iterable[str]) -> None:
    shown = list(lines)
    if shown:
        print("", *shown, sep="\n", flush=True)
