"""The virtual clock: time passes when the test says so, and in order."""

from __future__ import annotations

import asyncio
import os

import pytest
from tests.kit.clock import VirtualClock

pytestmark = pytest.mark.anyio


async def test_time_stands_still_until_it_is_advanced(clock: VirtualClock) -> None:
    sleeping = asyncio.create_task(asyncio.sleep(10))
    await clock.advance(9.9)
    assert not sleeping.done()
    await clock.advance(0.1)
    assert sleeping.done()


async def test_timers_fire_in_their_order_at_their_time(clock: VirtualClock) -> None:
    fired: list[tuple[str, float]] = []
    begun_s = clock.time()

    async def after(name: str, seconds: float, again: int = 0) -> None:
        await asyncio.sleep(seconds)
        fired.append((name, clock.time() - begun_s))
        if again:
            await after(name, seconds, again - 1)

    tasks = [asyncio.create_task(after("slow", 5)), asyncio.create_task(after("quick", 2, again=2))]
    await clock.advance(6)
    assert fired == [("quick", 2), ("quick", 4), ("slow", 5), ("quick", 6)]
    await asyncio.gather(*tasks)


async def test_time_outs_are_those_of_the_clock(clock: VirtualClock) -> None:
    async def wait() -> None:
        async with asyncio.timeout(3600):
            await asyncio.Event().wait()

    waiting = asyncio.create_task(wait())
    await clock.advance(3600)
    with pytest.raises(TimeoutError):
        await waiting


async def test_input_is_real(clock: VirtualClock) -> None:
    reading, writing = os.pipe()
    arrived = asyncio.Event()
    clock.add_reader(reading, arrived.set)
    os.write(writing, b"x")
    await arrived.wait()
    clock.remove_reader(reading)
    os.close(reading)
    os.close(writing)


async def test_timer_that_is_nearly_due_fires_at_its_time(clock: VirtualClock) -> None:
    """What waits for the rest of a period finds none left, and does not wait for it again."""
    due_s, rounds = clock.time() + 0.1, 0

    async def wait() -> None:
        nonlocal rounds
        while (rest_s := due_s - clock.time()) > 0:
            rounds += 1
            assert rounds < 10, "it spins"
            await asyncio.sleep(rest_s)

    waiting = asyncio.create_task(wait())
    await clock.advance(0.1 - 0.5e-9)  # half of the resolution of Linux's clock
    await waiting
    assert rounds == 1
