"""One command of a run, and several beside each other."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from tests.runner import result
from tests.runner.result import Result

NO_TESTS = 5
"""pytest's exit status for a selection without tests."""


@dataclass(frozen=True, slots=True)
class Job:
    """A command, and where it writes down what became of its tests."""

    name: str
    command: Sequence[str]
    folder: Path
    """Its working folder."""
    log: Path
    results: Path | None = None
    """What pytest writes with `--results`."""
    prefix: str = ""
    """What its node ids need before them to be paths from the checkout."""
    niceness: int = 0
    more: Mapping[str, str] = field(default_factory=dict)
    """Further environment variables."""


@dataclass(frozen=True, slots=True)
class Done:
    """What became of a job."""

    job: Job
    status: int
    seconds: float
    results: tuple[Result, ...]

    @property
    def failed_itself(self) -> bool:
        """Whether it failed otherwise than by a test that its results name."""
        if self.status in (0, NO_TESTS):
            return False
        return not any(one.outcome == "failed" for one in self.results)


def run(job: Job, *, shown: bool = False) -> Done:
    """Run a job to its end. What it prints goes to its log, and is shown as it comes or at the end
    of one that failed."""
    begun_s = time.monotonic()
    command = ["nice", "-n", str(job.niceness), *job.command]
    with (
        job.log.open("wb") as log,
        subprocess.Popen(
            command,
            cwd=job.folder,
            env={**os.environ, **job.more},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            bufsize=0,
        ) as process,
    ):
        assert process.stdout is not None  # it is a pipe
        while piece := process.stdout.read(65536):
            log.write(piece)
            if shown:
                _show(piece)
    status = process.returncode
    results = tuple(_from_checkout(job, one) for one in result.read(job.results or Path("-")))
    done = Done(job, status, time.monotonic() - begun_s, results)
    if not shown:
        _say(f"{job.name}: {_outcome(done)} in {done.seconds:.0f} s")
        if done.status not in (0, NO_TESTS):
            _show(job.log.read_bytes())
    return done


def beside(*queues: Sequence[Job]) -> list[Done]:
    """Run lanes at the same time, the jobs of each one after the other. The first lane is shown."""

    def ride(number: int, queue: Iterable[Job]) -> list[Done]:
        return [run(job, shown=number == 0) for job in queue]

    with ThreadPoolExecutor(len(queues)) as pool:
        done = pool.map(ride, range(len(queues)), queues)
        return [one for queue in done for one in queue]


def _from_checkout(job: Job, one: Result) -> Result:
    return Result(**{**one.to_dict(), "test": f"{job.prefix}{one.test}"})


def _outcome(done: Done) -> str:
    return "passed" if done.status in (0, NO_TESTS) else f"FAILED (status {done.status})"


def _say(line: str) -> None:
    _show(f"{line}\n".encode())


def _show(data: bytes) -> None:
    sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()
