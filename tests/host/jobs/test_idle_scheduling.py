"""What can wait gives way to what cannot, and is done in the end."""

from __future__ import annotations

import asyncio

import pytest

from nondum.host.jobs.idle_scheduling import IdleScheduler

pytestmark = pytest.mark.anyio


class Work:
    """Begins, waits to be let go, and counts how often it was begun and cancelled."""

    def __init__(self) -> None:
        self.begun, self.go = asyncio.Event(), asyncio.Event()
        self.times = self.cancelled = 0

    async def __call__(self) -> str:
        self.times += 1
        self.begun.set()
        try:
            await self.go.wait()
        except asyncio.CancelledError:
            self.cancelled += 1
            raise
        return "done"


async def test_work_is_done_when_nothing_is_urgent() -> None:
    work = Work()
    work.go.set()
    assert await IdleScheduler(settled_s=0.0).run(work) == "done"
    assert (work.times, work.cancelled) == (1, 0)


async def test_work_waits_for_what_is_urgent() -> None:
    quiet, work = IdleScheduler(settled_s=0.01), Work()
    work.go.set()
    with quiet.urgent():
        running = asyncio.create_task(quiet.run(work))
        done, _ = await asyncio.wait([running], timeout=0.05)
        assert not done
        assert not work.times
    assert await running == "done"


async def test_work_gives_way_and_is_begun_again() -> None:
    quiet, work = IdleScheduler(settled_s=0.01), Work()
    running = asyncio.create_task(quiet.run(work))
    await work.begun.wait()
    work.begun.clear()
    with quiet.urgent():
        await asyncio.wait([running], timeout=0.05)
        assert work.cancelled == 1
    await work.begun.wait()
    work.go.set()
    assert await running == "done"
    assert (work.times, work.cancelled) == (2, 1)


async def test_one_piece_of_work_at_a_time() -> None:
    quiet, first, second = IdleScheduler(settled_s=0.0), Work(), Work()
    running = [asyncio.create_task(quiet.run(work)) for work in (first, second)]
    await first.begun.wait()
    await asyncio.wait(running, timeout=0.05)
    assert not second.times
    first.go.set()
    second.go.set()
    assert await asyncio.gather(*running) == ["done", "done"]


async def test_cancelled_work_has_ended() -> None:
    quiet, work = IdleScheduler(settled_s=0.0), Work()
    running = asyncio.create_task(quiet.run(work))
    await work.begun.wait()
    running.cancel()
    await asyncio.wait([running])
    assert work.cancelled == 1
    work.go.set()
    assert await quiet.run(work) == "done"


async def test_work_that_fails_is_not_begun_again() -> None:
    quiet = IdleScheduler(settled_s=0.0)
    times = 0

    async def fail() -> None:
        nonlocal times
        times += 1
        raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        await quiet.run(fail)
    assert times == 1
