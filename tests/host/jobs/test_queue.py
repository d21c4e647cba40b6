"""A few at a time, in order, and each that waits knows how many are before it."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.jobs.queue import Queue

pytestmark = pytest.mark.anyio


async def test_those_who_wait_are_told_and_come_in_order() -> None:
    queue = Queue(2)
    told: list[tuple[str, int]] = []
    inside: list[str] = []
    done = asyncio.Event()

    async def visit(name: str) -> None:
        async with queue.turn(name, lambda ahead: told.append((name, ahead))):
            inside.append(name)
            await done.wait()

    visits = [asyncio.create_task(visit(name)) for name in "abcd"]
    await asyncio.sleep(0)
    assert inside == ["a", "b"]
    assert told == [("c", 2), ("d", 3)]
    done.set()
    await asyncio.gather(*visits)
    assert inside == ["a", "b", "c", "d"]
    assert told[2:] == [("c", 0), ("d", 0)]


async def test_who_gives_up_waiting_is_passed_over() -> None:
    queue = Queue(1)
    told: list[int] = []
    await queue.enter("a", told.append)
    waiting = [asyncio.create_task(queue.enter(name, told.append)) for name in "bc"]
    await asyncio.sleep(0)
    waiting[0].cancel()
    await asyncio.gather(waiting[0], return_exceptions=True)
    queue.leave("a")
    await waiting[1]
    assert told == [1, 2, 0]


@given(st.lists(st.sampled_from(["enter", "leave"]), max_size=12))
async def test_a_turn_is_had_and_given_back_once(steps: list[str]) -> None:
    """However often somebody enters and leaves, others get their turns afterwards."""
    queue = Queue(1)
    for step in steps:
        if step == "enter":
            await queue.enter("a", lambda ahead: None)
        else:
            queue.leave("a")
    queue.leave("a")
    async with asyncio.timeout(30):
        await queue.enter("b", lambda ahead: None)
        waits = asyncio.create_task(queue.enter("c", lambda ahead: None))
        await asyncio.sleep(0)
        assert not waits.done()
        queue.leave("b")
        await waits
