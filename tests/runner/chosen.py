"""`./run tests FOLDER…`: some tests, beside each other as in the full run."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.runner import full, job, report, stages
from tests.runner.stages import ROOT

ONE_PROCESS = ("-n", "-m", "-s", "--pdb", "--collect-only", "--co", "--fixtures", "--markers")
"""pytest's options of somebody who wants pytest as it is."""


def run(arguments: Sequence[str]) -> int:
    """Run what was asked for with pytest; the exit status."""
    stages.check_places(arguments)
    if any(word.split("=")[0] in ONE_PROCESS for word in arguments):
        command = [sys.executable, "-m", "pytest", *stages.INSTALLED, *arguments]
        return subprocess.run(command, cwd=ROOT, check=False).returncode
    folder = full.evidence_folder()
    beside = (*stages.at_once(2 * stages.PROCESSORS), "-m", "not alone", *arguments)
    jobs = [stages.pytest_job("chosen", folder, (*stages.INSTALLED, *beside))]
    if has_alone(arguments):
        options = (*stages.INSTALLED, "-m", "alone", *arguments)
        jobs.append(stages.pytest_job("alone", folder, options))
    done = [job.run(one, shown=True) for one in jobs]
    failed = [one for each in done for one in each.results if one.outcome == "failed"]
    died = [one for one in done if one.failed_itself]
    print(*report.failures(failed, died), sep="\n", flush=True)
    if failed or died:
        return 1
    shutil.rmtree(folder, ignore_errors=True)
    return job.NO_TESTS if all(one.status == job.NO_TESTS for one in done) else 0


def has_alone(arguments: Sequence[str]) -> bool:
    """Whether tests that run alone can be among those that were asked for."""
    named = [ROOT / word.split("::", 1)[0] for word in arguments if not word.startswith("-")]
    places = [place for place in named if place.exists()] or [ROOT / "tests"]
    files = (file for place in places for file in _test_files(place))
    return any("pytest.mark.alone" in file.read_text(encoding="utf-8") for file in files)


def _test_files(place: Path) -> list[Path]:
    return [place] if place.is_file() else sorted(place.rglob("test_*.py"))
