"""Plugins that use too much, and how they are watched in virtual time."""

from __future__ import annotations

from dataclasses import replace

from tests.kit.clock import VirtualClock
from tests.kit.processes import is_alive
from tests.kit.until import until_async
from tests.kit.workers import TIMING, WorkersUnderTest

from nondum.host.core.events.workers import WorkerExited, WorkerStrained
from nondum.host.workers.usage import UsageReader

FORK = "while True:\n    try:\n        os.fork()\n    except OSError:\n        pass"
WATCHED = replace(TIMING, look_s=0.1, spin_s=0.5, missed=1_000_000)
"""Looked at often; time passes faster than workers show signs of life, and none of them hangs."""


async def strained_by_spinning(tested: WorkersUnderTest, clock: VirtualClock) -> WorkerStrained:
    """Let time pass as fast as the worker `guest` computes, until it is told that it spins."""
    gauge = UsageReader(lambda: tested.workers.pids()["guest"], None)

    enough_s = 0.0

    def is_enough() -> bool:
        return max(gauge.wanted_s().values()) >= enough_s

    while not tested.told(WorkerStrained):
        enough_s = max(gauge.wanted_s().values()) + 2 * WATCHED.look_s
        await until_async("a spinning thread", is_enough)
        await clock.advance(WATCHED.look_s)
    return tested.told(WorkerStrained)[0]


async def exited_by_forking(tested: WorkersUnderTest, clock: VirtualClock) -> WorkerExited:
    """Let time pass as fast as the worker `guest` computes, which runs `FORK`, until it has ended:
    it is refused processes between any two looks at it, however slowly it comes to run."""
    pid = tested.workers.pids()["guest"]
    gauge = UsageReader(lambda: pid, None)
    enough_s = 0.0

    def is_enough() -> bool:
        return not is_alive(pid) or gauge.usage().cpu_s >= enough_s

    while is_alive(pid):
        enough_s = gauge.usage().cpu_s + 0.02
        await until_async("a worker that forks", is_enough)
        await clock.advance(WATCHED.look_s)
    return await clock.advance_until(tested.until(WorkerExited))
