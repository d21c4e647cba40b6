"""The other end of `children.py`: a process that does jobs, one after the other.

Run as a program, this is the fork server that such processes come from, and those that run a
service (`jobs.SERVICES`). They die with it, and it with the daemon; what they may use is bounded:
what they read was written by strangers.
"""

from __future__ import annotations

import contextlib
import gc
import os
import socket
import sys
import threading
import time
import traceback
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from nondum.host.core.brief import brief
from nondum.host.forking import fork_server
from nondum.host.jobs import table
from nondum.host.jobs.allowance import allowed, confine_process
from nondum.host.jobs.table import LONGEST, PROGRESS, Arguments, Progress, Report
from nondum.host.rpc.channel import Channel, Tell, conversation
from nondum.host.sandbox.inside import kernel
from nondum.host.sandbox.levels import host_children
from nondum.sdk.codec.values import to_plain
from nondum.sdk.errors import InstallFailed, NondumError, Problem
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.store import disk

PROGRESS_S = 0.1
"""Between two reports of one phase."""


def main(daemon: int, channel: int) -> None:
    """Fork a child for each request that comes over a socket. Returns in those that are done, too.

    What this process gives up, its children have not, either.
    """
    host_children.settle(daemon, keeps=("mounts",))  # drives are mounted by them
    server = os.getpid()
    name = fork_server.serve(socket.socket(fileno=channel), prepare=_prepare, ahead=_ahead())
    if name is None:
        return
    kernel.end_with(server)
    os.setsid()
    if (service := name.decode()) in table.SERVICES:
        table.find_service(service)(server)
    else:
        confine_process()
        work()


def work() -> None:
    """Do the jobs that are asked for over descriptor 0, a socket, until it ends."""
    Channel(conversation(), LONGEST).serve(_do)


def _prepare(name: bytes) -> None:
    """Import what a child is to do, once for all that will do it."""
    jobs = table.AT_ONCE if name.decode() == table.ANY else (name.decode(),)
    for job in jobs:
        _import(job)
    gc.freeze()  # a collection in a child would make pages its own that are shared


def _ahead() -> Iterator[None]:
    """Import what is then there when somebody waits for a job."""
    for job in table.AT_ONCE:
        _import(job)
        yield
    host_facts = import_module("nondum.wheelhouse.payload.host_facts")
    host_facts.probe(Path.cwd(), reserve_mb=0, confinement=Level.NONE)


def _import(name: str) -> None:
    find = table.find_service if name in table.SERVICES else table.find
    with contextlib.suppress(Exception):  # it will be the child's, which tells of it
        find(name)


def _do(job: str, arguments: Arguments, tell: Tell) -> Any:
    """Do a job. Raises `NondumError`."""
    try:
        with allowed(job):
            do = table.find(job)
            tell("begun", {})
            return do(arguments, _reporter(tell))
    except NondumError as error:
        error.problems = brief(error.problems)
        raise
    except OSError as error:
        where = Path(error.filename or arguments.get("store", ""))
        raise InstallFailed(*brief([disk.problem_of(error, job, where)])) from error
    except Exception as error:
        if disk.is_short_of_memory(error):
            raise InstallFailed(_too_much(job)) from error
        traceback.print_exc()
        message = f"{job}: {type(error).__name__}: {error}"
        fix = "see the log, and report it with what it says"
        raise InstallFailed(*brief([Problem("INTERNAL", message, fix=fix)])) from error


def _too_much(job: str) -> Problem:
    fix = "build the payload with less in it, or give the host more memory"
    return Problem("NO_MEMORY", f"{job} takes more memory than it may", fix=fix)


def _reporter(tell: Tell) -> Report:
    told: dict[str, float] = {}
    lock = threading.Lock()  # a job may have several threads

    def report(phase: str, done: int, total: int) -> None:
        with lock:
            now = time.monotonic()
            if done >= total or now - told.get(phase, 0.0) >= PROGRESS_S:
                told[phase] = now
                tell(PROGRESS, to_plain(Progress(phase, done, total)))

    return report


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
