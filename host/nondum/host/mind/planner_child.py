"""The process that one planner runs in: `planner_child MODULE:CLASS MB DAEMON`, run by `-m`.

It says what it speaks and handles, and plans, one task after the other, until its link to the
daemon ends (`nondum.host.rpc`). It is niced and limited in memory, and dies with the daemon. It is
kept while idle, so what it imports is little.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from functools import partial
from importlib import import_module
from typing import Any

from nondum.host.mind import planner_wire as wire
from nondum.host.rpc.channel import Channel, Tell, conversation
from nondum.host.sandbox.levels import host_children
from nondum.sdk.errors import PlannerFailed, Problem
from nondum.sdk.planner import GaveUp, Planner, TextPlanner

NICENESS = 10


def main(reference: str, memory_mb: int, daemon: int) -> int:
    """Serve one planner, which an entry point refers to, until the daemon is gone."""
    channel = Channel(conversation(), wire.MAX_BYTES)
    _limit(memory_mb, daemon)
    module, _, name = reference.partition(":")
    planner: Planner | TextPlanner = getattr(import_module(module), name)()
    channel.serve(partial(_do, planner))
    return 0


def _limit(memory_mb: int, daemon: int) -> None:
    host_children.settle(daemon)
    os.nice(NICENESS)
    size = memory_mb * 1024 * 1024
    resource.setrlimit(resource.RLIMIT_AS, (size, size))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _do(planner: Any, verb: str, asked: Any, _tell: Tell) -> Any:
    if verb == wire.DESCRIBE:
        return [planner.speaks, sorted(planner.handles)]
    until_s, body = asked  # by the clock that all processes of a machine share
    try:
        task = wire.task_of(planner.speaks, body)
        return wire.answer_to_wire(planner.plan(task, max(0.0, until_s - time.monotonic())))
    except MemoryError:
        return wire.answer_to_wire(GaveUp("it ran out of memory"))
    except Exception as error:  # whatever a planner raises is told to the host, and it may go on
        text = f"{type(error).__name__}: {error}"
        raise PlannerFailed(Problem("PLANNER_RAISED", text)) from error


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
