"""Lines of components, kept for who looks, and told to who waits."""

from __future__ import annotations

import asyncio

import pytest

from nondum.host.core.records.moment import Moment
from nondum.host.workers.logs import LINES, LogLine, Logs

pytestmark = pytest.mark.anyio


def line(text: str) -> LogLine:
    return LogLine(Moment(0.0, 0.0), "info", text)


async def test_lines_after_a_number_are_those_that_came_since() -> None:
    logs = Logs()
    logs.add("eye", line("one"))
    seen = logs.version
    logs.add("arm", line("two"))
    logs.add("eye", line("three"))
    assert [row.text for row in logs.of("eye", seen)] == ["three"]
    assert [row.text for row in logs.of("arm", seen)] == ["two"]
    assert [row.text for row in logs.of("eye")] == ["one", "three"]


async def test_who_waits_for_lines_hears_of_the_next() -> None:
    logs = Logs()
    waiting = asyncio.create_task(logs.changed(0))
    logs.add("eye", line("one"))
    assert await waiting == 1


async def test_who_lags_behind_gets_the_lines_that_are_kept() -> None:
    logs = Logs()
    for number in range(LINES + 5):
        logs.add("eye", line(str(number)))
    kept = logs.of("eye", after=2)
    assert (len(kept), kept[0].text) == (LINES, "5")
