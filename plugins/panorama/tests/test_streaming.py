"""Opening a recording: in a thread that tells of itself, and ends when it is halted."""

from __future__ import annotations

import asyncio
import threading

import pytest

from nondum_panorama.recording import Tell
from nondum_panorama.streaming import opened


def test_progress_is_told_in_steps_before_the_result_is_there() -> None:
    told: list[float] = []

    def opening(tell: Tell) -> str:
        for number in range(1000):
            tell((number + 1) / 1000)
        return "a recording"

    async def open_it() -> str:
        return await opened(lambda done, _: told.append(done), opening)

    assert asyncio.run(open_it()) == "a recording"
    assert told == [pytest.approx(step / 20) for step in range(1, 21)]


def test_thread_ends_with_its_next_frame_when_it_is_halted() -> None:
    begun, ended = threading.Event(), threading.Event()

    def opening(tell: Tell) -> None:
        try:
            while True:
                tell(0.5)
                begun.set()
        finally:
            ended.set()

    async def halt_it() -> None:
        reading = asyncio.ensure_future(opened(lambda *_: None, opening))
        await asyncio.to_thread(begun.wait)
        reading.cancel()
        await asyncio.wait([reading])
        assert reading.cancelled()

    asyncio.run(halt_it())
    assert ended.wait(60)
