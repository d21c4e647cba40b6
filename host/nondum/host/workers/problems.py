"""What can be wrong with a worker, each told in the same words wherever it is shown."""

from __future__ import annotations

import signal
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from nondum.host.core.placed import placed
from nondum.host.sandbox.cgroups import Usage
from nondum.host.workers.process import exit_words
from nondum.host.workers.spec import Limits
from nondum.sdk.errors import NondumError, Problem, ProtocolViolation

REMOVED = "COMPONENT_REMOVED"
EXITED = "WORKER_EXITED"
SCRATCH_FULL = "SCRATCH_FULL"
MEGABYTE = 1024 * 1024
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
    return Problem(EXITED, words, where=component, fix=_author(component))


def exhausted(
    component: str,
    limits: Limits,
    usage: Usage,
    status: int,
    said: Sequence[str],
) -> Problem | None:
    """What it had no more of when its process ended, where that is known."""
    last = next((line for line in reversed(said) if line.strip()), "")
    if (status == -signal.SIGKILL and usage.oom_kills) or "MemoryError" in last:
        return out_of_memory(component, limits.memory_mb)
    if "[Errno 24]" in last:  # EMFILE
        return too_many_descriptors(component, limits.descriptors)
    if usage.refused_tasks and ("[Errno 11]" in last or "can't start new thread" in last):
        return too_many_tasks(component, limits.tasks)
    return None


def out_of_memory(component: str, memory_mb: int) -> Problem:
    """The kernel ended it, or refused it memory."""
    return Problem(
        "WORKER_OOM",
        f"the worker used up its {memory_mb} MB of memory",
        where=component,
        fix="if it needs more, raise `memory_mb` in [workers]; else tell the plugin's author",
    )


def too_many_tasks(component: str, tasks: int) -> Problem:
    """It starts processes or threads without end."""
    return Problem(
        "WORKER_TASKS",
        f"the worker has all the {tasks} processes and threads that it may have, and wants more",
        where=component,
        fix="if it needs more, raise `tasks` in [workers]; else tell the plugin's author",
    )


def too_many_descriptors(component: str, descriptors: int) -> Problem:
    """It opens files and sockets and does not close them."""
    return Problem(
        "WORKER_FDS",
        f"the worker has nearly all the {descriptors} open files that it may have, or all",
        where=component,
        fix="if it needs more, raise `descriptors` in [workers]; else tell the plugin's author",
    )


def in_flight(component: str, count: int) -> Problem:
    """It sends descriptors that nothing reads, until no process of its user can send any."""
    return Problem(
        "WORKER_IN_FLIGHT",
        f"the worker has sent {count} descriptors that nothing reads, and held up other workers",
        where=component,
        fix=_author(component),
    )


def launch_crowded(component: str) -> Problem:
    """No descriptor could be handed to its process yet."""
    return Problem(
        "LAUNCH_CROWDED",
        "the worker cannot be started now: too many descriptors are under way between processes of"
        " this user",
        where=component,
        fix="it is tried again; see `nondum logs` for the worker that is ended for it",
    )


def scratch_full(component: str, scratch_mb: int) -> Problem:
    """It writes and writes."""
    return Problem(
        SCRATCH_FULL,
        f"the worker has filled its scratch folder of {scratch_mb} MB, or nearly",
        where=component,
        fix="if it needs more, raise `scratch_mb` in [workers]; else tell the plugin's author",
    )


def spinning(component: str, busy_s: float) -> Problem:
    """It keeps a processor busy for nothing."""
    return Problem(
        "WORKER_CPU",
        f"the worker has kept a processor busy for {busy_s:g} s without being asked for anything",
        where=component,
        fix="`nondum payload forget` it or pull it if that hurts; bound it by `cpu_percent` in "
        "[workers]",
    )


def before_start(problem: Problem) -> Problem:
    """The same for a worker that had not started yet."""
    if problem.code != EXITED:
        return problem
    return replace(problem, code="WORKER_START_FAILED")


def hung_up(component: str) -> Problem:
    """It closed its link and went on."""
    message = "the worker closed its link but did not end"
    return Problem("WORKER_HUNG", message, where=component, fix=_author(component))


def silent(component: str, silence_s: float, place: str = "") -> Problem:
    """Its heartbeat stopped; `place` is where its loop stood, if that is known."""
    message = f"the worker showed no sign of life for {silence_s:g} s"
    if place:
        message += f": its loop is held up in {place}"
    return Problem("WORKER_HUNG", message, where=component, fix=_author(component))


def overdue(component: str, startup_s: float) -> Problem:
    """It did not come through its start."""
    message = f"it did not start within {startup_s:g} s"
    fix = f"see `nondum logs {component}`; a slow plugin needs a longer [workers] startup_s"
    return Problem("WORKER_HUNG", message, where=component, fix=fix)


def unhalted(component: str, behaviour: str, halt_s: float) -> Problem:
    """A behaviour went on after it was asked to halt."""
    message = f"behaviour {behaviour!r} did not halt within {halt_s:g} s"
    return Problem("HALT_OVERDUE", message, where=component, fix=_author(component))


def crash_loop(component: str, restarts: int, window_s: float, last: Problem) -> Problem:
    """It was restarted too often."""
    return Problem(
        "WORKER_CRASH_LOOP",
        f"it failed again after {restarts} restarts in {window_s:g} s; the last time: {last}",
        where=component,
        fix="pull the payload and plug it in again, or ask for another try",
    )


def not_running(component: str) -> Problem:
    """There is no worker to ask."""
    fix = f"`nondum components` says how {component} is; plug its payload in again"
    return Problem("NOT_RUNNING", "no worker of this component runs now", where=component, fix=fix)


def foul(component: str, violation: ProtocolViolation) -> Problem:
    """It broke the protocol."""
    found = violation.problems[0]
    if found.code in _SPEAKING:
        return replace(found, where=component, fix=found.fix or _author(component))
    message = f"the worker broke the protocol: {found.code} {found.message}"
    return Problem("PROTO_VIOLATION", message, where=component, fix=_author(component))


def located(component: str, error: NondumError) -> Iterator[Problem]:
    """A worker's own problems, with its name."""
    for problem in error.problems:
        place = "" if problem.where == component else problem.where
        yield replace(problem, where=placed(component, place))


def words(error: NondumError) -> str:
    """All problems of an error in one line."""
    return "; ".join(str(problem) for problem in error.problems)


def _author(component: str) -> str:
    return f"it is started again; see `nondum logs {component}`, and tell the plugin's author"
