"""The planner: two programs run one after the other, and their exit codes taken at their word.

Exit codes: https://www.fast-downward.org/latest/documentation/exit-codes/
"""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import ClassVar

from nondum.sdk.planner import (
    CONDITIONAL_EFFECTS,
    DERIVED_PREDICATES,
    AlreadyTrue,
    GaveUp,
    PddlTask,
    PlanText,
    TextAnswer,
    Unsolvable,
)
from nondum_planner_fast_downward.engine import Engine, find_engine

MEMORY_MB = 4096
"""What each program may take, if this process may take no less."""
_UNSOLVABLE = frozenset({10, 11})
_UNSAID = {
    12: "its search is not complete, and found nothing",
    20: "its translator ran out of memory",
    21: "its translator ran out of time",
    22: "it ran out of memory",
    23: "it ran out of time",
    24: "it ran out of memory and time",
}
_PSEUDO_STEP = "__extra_goal_operator"
"""What kstar-planner's build ends a plan with."""
_PR_SET_PDEATHSIG = 1  # linux/prctl.h
_LIBC = ctypes.CDLL(None)


class FastDownwardPlanner:
    """LAMA's first iteration: greedy search with landmarks and FF, whatever actions cost."""

    speaks: ClassVar[str] = "pddl"
    handles: ClassVar[frozenset[str]] = frozenset({CONDITIONAL_EFFECTS, DERIVED_PREDICATES})

    def __init__(self, engine: Engine | None = None) -> None:
        """`engine` is the one of an installed wheel, unless another is given."""
        self._engine = engine or find_engine()

    def plan(self, task: PddlTask, deadline_s: float) -> TextAnswer:
        """Search for at most `deadline_s` seconds."""
        if self._engine is None:
            return GaveUp("no Fast Downward is installed: pip install up-fast-downward")
        with TemporaryDirectory(prefix="nondum-fast-downward-") as folder:
            try:
                return _Run(self._engine, Path(folder), time.monotonic() + deadline_s).answer(task)
            except subprocess.TimeoutExpired:
                return GaveUp(f"no plan within {deadline_s:g} s")


class _Run:
    """One task in one folder. Raises `subprocess.TimeoutExpired` at the deadline."""

    def __init__(self, engine: Engine, folder: Path, until_s: float) -> None:
        self._engine = engine
        self._folder = folder
        self._until_s = until_s

    def answer(self, task: PddlTask) -> TextAnswer:
        (self._folder / "domain.pddl").write_text(task.domain, encoding="utf-8")
        (self._folder / "problem.pddl").write_text(task.problem, encoding="utf-8")
        (self._folder / self._engine.plan).parent.mkdir(exist_ok=True)
        code = self._ran([*self._engine.translate, "domain.pddl", "problem.pddl"])
        if code == 0:
            search = [*self._engine.search, "--internal-plan-file", "plan"]
            code = self._ran(search, reads="output.sas")
        if code == 0:
            return self._plan()
        if code in _UNSOLVABLE and self._is_safe():
            return Unsolvable("exhausted")
        return GaveUp(self._reason(code))

    def _ran(self, command: Sequence[str], *, reads: str = os.devnull) -> int:
        """The exit code of a program, which is killed when it overruns or is not waited for."""
        with (
            (self._folder / reads).open("rb") as stdin,
            (self._folder / "log").open("wb") as log,
            subprocess.Popen(
                command,
                cwd=self._folder,
                stdin=stdin,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, **self._engine.environment, "PYTHONHASHSEED": "0"},
                preexec_fn=_limited,
            ) as program,
        ):
            try:
                return program.wait(max(0.0, self._until_s - time.monotonic()))
            finally:
                program.kill()

    def _plan(self) -> TextAnswer:
        written = self._folder / self._engine.plan
        if not written.exists():
            return GaveUp("it says that it has a plan, and there is none")
        lines = written.read_text(encoding="utf-8").splitlines()
        steps = [line.strip("() ") for line in lines if not line.startswith(";")]
        if steps and steps[-1] == _PSEUDO_STEP:
            steps.pop()
        return PlanText(tuple(steps)) if steps else AlreadyTrue()

    def _is_safe(self) -> bool:
        """Whether a state that its heuristics give up has no plan: not so with axioms, to which it
        also makes some quantifiers."""
        translated = self._folder / "output.sas"
        return not translated.exists() or "begin_rule" not in translated.read_text()

    def _reason(self, code: int) -> str:
        if code in _UNSOLVABLE:
            return "it found nothing, but is not sure to see everything where there are axioms"
        if code in _UNSAID:
            return _UNSAID[code]
        said = (self._folder / "log").read_text(encoding="utf-8", errors="replace").split("\n")
        last = next((line for line in reversed(said) if line.strip()), "nothing")
        ended = f"by signal {-code}" if code < 0 else f"with {code}"
        return f"it ended {ended}, and last said: {last.strip()[:200]}"


def _limited() -> None:
    """Limits of the program that is being started: memory, no core file, and a parent."""
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    wanted = MEMORY_MB * 1024 * 1024
    size = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
    resource.setrlimit(resource.RLIMIT_AS, (size, size))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
