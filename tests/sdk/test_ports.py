"""Ends of streams in a worker: what is wrong is passed over, and what is slow flows."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any

import pytest
from tests.kit.clock import VirtualClock

from nondum.sdk import Header, Text
from nondum.sdk.pace import FIRST_S, PERIODS
from nondum.sdk.packets import MemoryPackets
from nondum.sdk.ports import InputPort, OutputPort
from nondum.sdk.wire import pack

pytestmark = pytest.mark.anyio


def sender() -> tuple[InputPort, Callable[..., Any]]:
    """An input, and a producer that does not look at what it sends."""
    port, (ours, theirs) = InputPort(), MemoryPackets.pair()
    port.connect("words", "text", theirs)
    ours.open(lambda data, handles: None, lambda violation: None)

    async def send(seq: int, text: object) -> None:
        arrived = asyncio.ensure_future(port.arrival())
        await asyncio.sleep(0)
        ours.send(pack([0, seq, {"header": {"stamp_s": 1.0}, "text": text}, None]))
        await arrived

    return port, send


async def test_wrong_message_is_passed_over(caplog: pytest.LogCaptureFixture) -> None:
    port, send = sender()
    right = Text(Header(1.0), "right")
    await send(1, "right")
    assert port.newest() == right
    with caplog.at_level(logging.WARNING):
        await send(2, 3)
        assert port.newest() == right
        await send(3, 4)
        assert port.newest() == right
    assert port.stream == "words"
    await send(4, "again")
    assert port.newest() == Text(Header(1.0), "again")
    assert [record.getMessage().count("MESSAGE_FIELD") for record in caplog.records] == [1]


async def test_stream_that_began_slowly_flows_until_its_second_message(clock: VirtualClock) -> None:
    first_took_s = FIRST_S
    flows: list[bool] = []
    port = OutputPort("words", "text", lambda one: flows.append(one.is_flowing))
    port.open()
    await clock.advance(first_took_s)
    port.send(Text(Header(1.0), "slow"))
    await clock.advance(PERIODS * first_took_s - 0.1)
    assert flows == [True]
    await clock.advance(0.2)
    assert flows == [True, False]
    port.close()


async def test_stream_that_began_at_once_ends_sooner(clock: VirtualClock) -> None:
    flows: list[bool] = []
    port = OutputPort("words", "text", lambda one: flows.append(one.is_flowing))
    port.open()
    port.send(Text(Header(1.0), "quick"))
    await clock.advance(FIRST_S - 0.1)
    assert flows == [True]
    await clock.advance(0.2)
    assert flows == [True, False]
    port.close()
