"""The process that one planner runs in: `planner_child MODULE:CLASS MB DAEMON`, run by `-m`.

It says what it speaks and handles, reads tasks from standard input and writes answers to standard
output until the input ends. It is niced and limited in memory, and dies with the daemon. It is kept
while idle, so what it imports is little.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from importlib import import_module
from typing import Any, BinaryIO

from nondum.host.mind import planner_wire as wire
from nondum.host.sandbox.levels import host_children
from nondum.sdk.planner import Planner, TextPlanner

NICENESS = 10


def main(reference: str, memory_mb: int, daemon: int) -> int:
    """Serve one planner, which an entry point refers to, until standard input ends."""
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # what a planner prints must not get between the answers
    _limit(memory_mb, daemon)
    module, _, name = reference.partition(":")
    planner: Planner | TextPlanner = getattr(import_module(module), name)()
    answers.write(wire.frame(["ready", planner.speaks, sorted(planner.handles)]))
    while (body := _read(requests)) is not None:
        answers.write(wire.frame(_answer(planner, wire.unframed(body))))
    return 0


def _limit(memory_mb: int, daemon: int) -> None:
    host_children.settle(daemon)
    os.nice(NICENESS)
    size = memory_mb * 1024 * 1024
    resource.setrlimit(resource.RLIMIT_AS, (size, size))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _answer(planner: Any, request: Any) -> list[Any]:
    until_s, body = request  # by the clock that all processes of a machine share
    task_of = wire.text_from_wire if planner.speaks == "pddl" else wire.task_from_wire
    try:
        task = task_of(wire.unframed(body))
        return wire.answer_to_wire(planner.plan(task, max(0.0, until_s - time.monotonic())))
    except MemoryError:
        return ["gave up", "it ran out of memory"]
    except Exception as error:  # whatever a planner raises is told to the host, and it may go on
        return ["failed", f"{type(error).__name__}: {error}"]


def _read(stream: BinaryIO) -> bytes | None:
    head = stream.read(wire.LENGTH.size)
    if len(head) < wire.LENGTH.size:
        return None
    (length,) = wire.LENGTH.unpack(head)
    return stream.read(length)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
