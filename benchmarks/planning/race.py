"""One contender at one problem: its process is watched, and its plan is checked."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from functools import lru_cache
from pathlib import Path
from typing import Any

from benchmarks.planning.contenders import GAVE_UP, PLAN
from benchmarks.planning.problems import Problem
from benchmarks.planning.results import Attempt

from nondum.sdk.errors import FragmentRefused
from nondum_pddl_workbench.rehearsal import Rehearsed, rehearsed
from nondum_pddl_workbench.standalone import Standalone, load

ROOT = Path(__file__).parents[2]
GRACE_S = 0.5
"""How much longer than the limit a process may take to say that it has given up."""


def attempt(problem: Problem, contender: str, limit_s: float) -> Attempt:
    """Let a contender try; all that it started is dead at the limit."""
    module = "benchmarks.planning.contenders"
    files = (str(problem.domain), str(problem.problem))
    began_s = time.monotonic()
    with subprocess.Popen(
        [sys.executable, "-m", module, contender, *files, str(limit_s)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        cwd=ROOT,
        env={**os.environ, "PYTHONHASHSEED": "0"},
        start_new_session=True,
    ) as process:
        try:
            out, _ = process.communicate(timeout=limit_s + GRACE_S)
        except subprocess.TimeoutExpired:
            out = b""
        finally:
            _kill(process.pid)
    took_s = time.monotonic() - began_s
    found = _said(out)
    if found["said"] == PLAN and took_s > limit_s:
        found["said"] = GAVE_UP
    checked = _checked(problem, found["steps"]) if found["said"] == PLAN else None
    return Attempt(
        problem=str(problem),
        group=problem.group,
        contender=contender,
        said=found["said"],
        took_s=took_s,
        phases=found["phases"],
        steps=len(found["steps"]),
        cost=checked.cost if checked else 0,
        is_valid=not (checked and checked.problems),
        why=found["why"],
    )


def _kill(pid: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)


def _said(out: bytes) -> dict[str, Any]:
    """The last line; what a process that was killed has not said is that it gave up."""
    lines = out.decode("utf-8", errors="replace").strip().splitlines()
    try:
        found = json.loads(lines[-1]) if lines else None
    except ValueError:
        found = None
    return (
        found
        if isinstance(found, dict)
        else {"said": GAVE_UP, "steps": [], "phases": {}, "why": "time"}
    )


def _checked(problem: Problem, steps: list[str]) -> Rehearsed | None:
    """What nondum's check on the schemas says; None where nondum does not read the problem."""
    read = _loaded(problem)
    return rehearsed(read.merged, read.facts, read.goal, steps) if read else None


@lru_cache(maxsize=1)
def _loaded(problem: Problem) -> Standalone | None:
    texts = (
        problem.domain.read_text(encoding="utf-8"),
        problem.problem.read_text(encoding="utf-8"),
    )
    try:
        return load(texts[0], str(problem.domain), texts[1], str(problem.problem))
    except FragmentRefused:
        return None
