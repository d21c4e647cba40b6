"""News: those who watch are woken by everything that happened, and not by every byte copied."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from nondum.host.control.news import News, Progress
from nondum.host.core.events.drives import DriveRemoved
from nondum.host.core.events.facts import FactForgotten
from nondum.host.core.events.payloads import PayloadCopied, ProgressMade

pytestmark = pytest.mark.anyio


class Clock:
    """A clock that is set by hand."""

    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


async def test_what_happened_wakes_every_watcher() -> None:
    news = News()
    watchers = [asyncio.create_task(news.changed(news.version)) for _ in range(2)]
    await asyncio.sleep(0)
    assert not any(watcher.done() for watcher in watchers)
    news.on_event(DriveRemoved("slot-a"))
    assert await asyncio.gather(*watchers) == [1, 1]


async def test_one_who_looks_late_is_not_kept_waiting() -> None:
    news = News()
    news.on_event(DriveRemoved("slot-a"))
    assert await news.changed(0) == 1


async def test_what_the_mind_alone_hears_of_is_no_news() -> None:
    news = News()
    news.on_event(FactForgotten("eye", "found", ("person", "rover")))
    assert news.version == 0


async def test_progress_is_kept_until_the_step_is_done() -> None:
    news = News()
    news.on_event(ProgressMade("key", "copy", 10, 40))
    assert news.progress("key") == Progress("copy", 10, 40)
    news.on_event(PayloadCopied("key"))
    assert news.progress("key") is None
    assert news.progress(str(Path("other"))) is None


async def test_progress_is_told_at_a_pace_for_people() -> None:
    clock = Clock()
    news = News(clock)
    for done in range(1000):
        news.on_event(ProgressMade("key", "copy", done, 1000))
    assert news.version == 1
    clock.now_s += 1.0
    news.on_event(ProgressMade("key", "copy", 1000, 1000))
    news.on_event(ProgressMade("key", "unpack", 0, 1000))
    assert news.version == 3
