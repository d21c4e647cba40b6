"""What can be wrong with a worker, each told in the same words wherever it is shown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from nondum.host.workers.process import exit_words
from nondum.sdk.errors import NondumError, Problem, ProtocolViolation

REMOVED = "COMPONENT_REMOVED"
EXITED = "WORKER_EXITED"
_SPEAKING = frozenset({"PROTO_VERSION", "BACKPRESSURE", "RESULT_INVALID"})
"""Codes of violations that say more than that the protocol was broken."""


def removed(component: str) -> Problem:
    """It was taken away: nothing is wrong with it."""
    return Problem(REMOVED, "the component was removed", where=component)


def exited(component: str, status: int, said: Iterable[str]) -> Problem:
    """Its process ended by itself; `said` is the end of its standard error."""
    words = f"the worker {exit_words(status)}"
    if tail := "; ".join(said):
        words += f" and said: {tail}"
    return Problem(EXITED, words, where=component)


def before_start(problem: Problem) -> Problem:
    """The same for a worker that had not started yet."""
    if problem.code != EXITED:
        return problem
    return replace(problem, code="WORKER_START_FAILED")


def hung_up(component: str) -> Problem:
    """It closed its link and went on."""
    return Problem("WORKER_HUNG", "the worker closed its link but did not end", where=component)


def silent(component: str, silence_s: float) -> Problem:
    """Its heartbeat stopped."""
    message = f"the worker showed no sign of life for {silence_s:g} s"
    return Problem("WORKER_HUNG", message, where=component)


def overdue(component: str, startup_s: float) -> Problem:
    """It did not come through its start."""
    message = f"it did not start within {startup_s:g} s"
    fix = f"see `nondum logs {component}`; a slow plugin needs a longer [workers] startup_s"
    return Problem("WORKER_HUNG", message, where=component, fix=fix)


def unhalted(component: str, behaviour: str, halt_s: float) -> Problem:
    """A behaviour went on after it was asked to halt."""
    message = f"behaviour {behaviour!r} did not halt within {halt_s:g} s"
    return Problem("HALT_OVERDUE", message, where=component)


def crash_loop(component: str, restarts: int, window_s: float, last: Problem) -> Problem:
    """It was restarted too often."""
    return Problem(
        "WORKER_CRASH_LOOP",
        f"it failed again after {restarts} restarts in {window_s:g} s; the last time: {last}",
        where=component,
        fix="pull the payload and plug it in again, or ask for another try",
    )


def not_running(component: str) -> Problem:
    """There is nobody to ask."""
    return Problem("NOT_RUNNING", "no worker of this component runs now", where=component)


def foul(component: str, violation: ProtocolViolation) -> Problem:
    """It broke the protocol."""
    found = violation.problems[0]
    if found.code in _SPEAKING:
        return replace(found, where=component)
    message = f"the worker broke the protocol: {found.code} {found.message}"
    return Problem("PROTO_VIOLATION", message, where=component)


def located(component: str, error: NondumError) -> Iterator[Problem]:
    """A worker's own problems, with its name."""
    for problem in error.problems:
        if problem.where in ("", component):
            yield replace(problem, where=component)
        else:
            yield replace(problem, where=f"{component} ({problem.where})")


def words(error: NondumError) -> str:
    """All problems of an error in one line."""
    return "; ".join(str(problem) for problem in error.problems)
