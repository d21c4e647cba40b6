"""Work on what strangers wrote, tried first in a copy of this process that may die of it.

Parsers can be made to take quadratic time or thousandfold memory by a few kilobytes. What was
tried here once, within its limits, may be done again without them.
"""

from __future__ import annotations

import ctypes
import json
import os
import resource
import signal
from collections.abc import Callable
from typing import NoReturn

from nondum.host.jobs.allowance import data_bytes, set_limit
from nondum.sdk.errors import NondumError, PayloadRefused, Problem

CPU_S = 2
MEMORY_BYTES = 128 * 1024 * 1024
"""Beyond what the process had before."""

_PR_SET_PDEATHSIG = 1
_DONE, _REFUSED, _TOO_MUCH = 0, 3, 4


def run(work: Callable[[], object], where: str) -> None:
    """Try it. Only to be called where there is but one thread.

    Raises `PayloadRefused` with the problems that it raised, or METADATA_LIMIT when it took more
    processor time or memory than it may.
    """
    reading, writing = os.pipe()
    parent, pid = os.getpid(), os.fork()
    if pid == 0:
        _try(work, writing, parent)
    os.close(writing)
    with os.fdopen(reading, "rb") as answer:
        said = answer.read()
    status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    if status == _REFUSED:
        raise PayloadRefused(*(Problem(**problem) for problem in json.loads(said)))
    if status != _DONE:
        raise PayloadRefused(_limit(where, status))


def _try(work: Callable[[], object], writing: int, parent: int) -> NoReturn:
    """The copy's whole life."""
    status = _TOO_MUCH
    try:
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() == parent:
            set_limit(resource.RLIMIT_CPU, CPU_S, for_good=True)
            set_limit(resource.RLIMIT_DATA, data_bytes() + MEMORY_BYTES, for_good=True)
            work()
            status = _DONE
    except NondumError as error:
        problems = json.dumps([problem.to_dict() for problem in error.problems])
        with os.fdopen(writing, "w") as answer:
            answer.write(problems)
        status = _REFUSED
    except MemoryError:
        status = _TOO_MUCH
    except Exception:  # done again without limits, it is told with its traceback
        status = _DONE
    finally:
        os._exit(status)  # nothing of the process that this is a copy of is to be tidied up


def _limit(where: str, status: int) -> Problem:
    ended = signal.Signals(-status).name if status < 0 else "memory"
    return Problem(
        "METADATA_LIMIT",
        f"manifest, locks and index cannot be read with what a payload is given ({ended})",
        where=where,
        need=f"at most {CPU_S} s of processor time and {MEMORY_BYTES // 1024**2} MB",
        have="more",
        fix="build the payload again, with less in its metadata",
    )
