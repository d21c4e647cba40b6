"""The other end of `children.py`: a process that does jobs, one after the other.

It dies with the daemon, and what it may use is bounded: what it reads was written by strangers.
"""

from __future__ import annotations

import json
import os
import select
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

from nondum.host.brief import brief
from nondum.host.confinement import own_children
from nondum.host.lifecycle import jobs
from nondum.host.lifecycle.allowance import allowed, confine_process
from nondum.sdk.errors import NondumError, Problem
from nondum.wheelhouse import disk

PROGRESS_S = 0.1
"""Between two reports of one phase."""

IDLE_S = 0.1
"""A child that has nothing to do for so long makes ready for whatever comes."""


def main(daemon: int) -> None:
    """Do jobs from stdin until it ends."""
    own_children.settle(daemon, keeps=("mounts",))  # drives are mounted by them
    confine_process()
    if not select.select([sys.stdin], [], [], IDLE_S)[0]:
        _warm()
    # Whatever prints goes to stderr: stdout belongs to the conversation.
    with os.fdopen(os.dup(1), "w", buffering=1) as answers:
        os.dup2(2, 1)
        for line in sys.stdin:
            request = json.loads(line)
            _say(answers, _do(request["job"], request["arguments"], answers))


def _warm() -> None:
    """Find and import what is then there when somebody waits for a job."""
    from nondum.wheelhouse import preflight

    for job in jobs.AT_ONCE:
        jobs.find(job)
    preflight.probe(Path.cwd(), reserve_mb=0, confinement=0)


def _do(job: str, arguments: dict[str, Any], answers: TextIO) -> dict[str, Any]:
    try:
        with allowed(job):
            do = jobs.find(job)
            _say(answers, {"begun": job})
            return {"result": do(arguments, _reporter(answers))}
    except NondumError as error:
        return _failure(type(error).__name__, *error.problems)
    except OSError as error:
        where = Path(error.filename or arguments.get("store", ""))
        return _failure("InstallFailed", disk.problem_of(error, job, where))
    except Exception as error:
        if disk.is_short_of_memory(error):
            return _failure("InstallFailed", _too_much(job))
        traceback.print_exc()
        message = f"{job}: {type(error).__name__}: {error}"
        fix = "see the log, and report it with what it says"
        return _failure("InstallFailed", Problem("INTERNAL", message, fix=fix))


def _too_much(job: str) -> Problem:
    fix = "build the payload with less in it, or give the host more memory"
    return Problem("NO_MEMORY", f"{job} takes more memory than it may", fix=fix)


def _failure(kind: str, *problems: Problem) -> dict[str, Any]:
    return {"error": kind, "problems": [problem.to_dict() for problem in brief(problems)]}


def _reporter(answers: TextIO) -> Callable[[str, int, int], None]:
    told: dict[str, float] = {}

    def report(phase: str, done: int, total: int) -> None:
        now = time.monotonic()
        if done >= total or now - told.get(phase, 0.0) >= PROGRESS_S:
            told[phase] = now
            _say(answers, {"progress": [phase, done, total]})

    return report


def _say(answers: TextIO, answer: dict[str, Any]) -> None:
    answers.write(json.dumps(answer, separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main(int(sys.argv[1]))
