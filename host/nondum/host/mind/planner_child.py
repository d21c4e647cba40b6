"""Processes of planners. Run as a program, this is the fork server that they come from.

A planner's process says what the planner speaks and handles, and plans, one task after the other,
until its link to the daemon ends (`nondum.host.rpc`). It is niced and limited in memory, and dies
with the server, and that with the daemon. The server has imported the planners, so that a search
begins at once; `PYTHONHASHSEED` is the server's, so that searches come out the same each time.
"""

from __future__ import annotations

import gc
import json
import os
import resource
import signal
import socket
import sys
import time
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from nondum.host.forking import fork_server
from nondum.host.mind import planner_wire as wire
from nondum.host.rpc.channel import Channel, Tell, conversation
from nondum.host.sandbox.inside import kernel
from nondum.host.sandbox.levels import host_children
from nondum.sdk.errors import PlannerFailed, Problem
from nondum.sdk.planner import GaveUp, Planner, TextPlanner

NICENESS = 10
TRIAL_S = 20
"""How long a planner may take to be imported before the server leaves that to its process."""


def start_of(reference: str, memory_mb: int, folder: str) -> str:
    """Asks the server for the process of a planner (`module:class`), with a limit, and a folder for
    its temporary files, if there is one."""
    return json.dumps([reference, memory_mb, folder])


def expected(reference: str) -> str:
    """Has the server import a planner."""
    return json.dumps([reference])


def main(daemon: int, channel: int) -> None:
    """Fork a process for each request that comes over a socket. Returns in those that are done,
    too."""
    host_children.settle(daemon)
    server = os.getpid()
    asked = fork_server.serve(socket.socket(fileno=channel), prepare=_prepare)
    if asked is None:
        return
    kernel.end_with(server)
    os.setsid()
    reference, memory_mb, folder = json.loads(asked)
    if folder:
        os.environ["TMPDIR"] = folder
    os.dup2(1, 2)  # what it prints is not shown
    link = Channel(conversation(), wire.MAX_BYTES)
    _limit(memory_mb)
    link.serve(partial(_do, _class_of(reference)()))


def _prepare(asked: bytes) -> None:
    """Import a planner that is expected, where that leaves the server fit to fork; for a task that
    waits, its process does so at once."""
    reference, *wanted = json.loads(asked)
    if wanted:
        return
    trial = os.fork()
    if trial == 0:
        signal.alarm(TRIAL_S)
        os._exit(_tried(reference))
    _, status = os.waitpid(trial, 0)
    if status == 0:
        _class_of(reference)
    gc.freeze()  # a collection in a process would make pages its own that are shared


def _tried(reference: str) -> int:
    try:
        _class_of(reference)
    except BaseException:  # its process will tell of it
        return 1
    return int(len(list(Path("/proc/self/task").iterdir())) > 1)  # threads are not forked


def _class_of(reference: str) -> Any:
    module, _, name = reference.partition(":")
    return getattr(import_module(module), name)


def _limit(memory_mb: int) -> None:
    os.nice(NICENESS)
    size = memory_mb * 1024 * 1024
    resource.setrlimit(resource.RLIMIT_AS, (size, size))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _do(planner: Planner | TextPlanner, verb: str, asked: Any, _tell: Tell) -> Any:
    if verb == wire.DESCRIBE:
        return [planner.speaks, sorted(planner.handles)]
    until_s, body = asked  # by the clock that all processes of a machine share
    try:
        task = wire.task_of(planner.speaks, body)
        return wire.answer_to_wire(planner.plan(task, max(0.0, until_s - time.monotonic())))  # type: ignore[arg-type]  # what it speaks
    except MemoryError:
        return wire.answer_to_wire(GaveUp("it ran out of memory"))
    except Exception as error:  # whatever a planner raises is told to the host, and it may go on
        text = f"{type(error).__name__}: {error}"
        raise PlannerFailed(Problem("PLANNER_RAISED", text)) from error


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
