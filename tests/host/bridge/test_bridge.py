"""Streams between two bridges: what arrives, how often it is sent, and how it ends."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

import numpy as np
import pytest
from tests.host.bridge.hosts import HERE, Over, pair, sending

from nondum.sdk.messages import Header, Image
from nondum.sdk.streams import Producer

pytestmark = pytest.mark.anyio

NOISE = np.random.default_rng(7).integers(0, 256, (48, 64, 3), np.uint8)


def noise(seq: int) -> Image:
    header = Header(stamp_s=12.5 + seq, frame_id="rover__cam__camera", seq=seq)
    return Image.from_array(header, NOISE, "bgr8")


@contextlib.asynccontextmanager
async def sent(producer: Producer, rate_hz: float = 100.0) -> AsyncIterator[None]:
    """Frames, for as long as the block lasts."""
    task = asyncio.create_task(sending(producer, noise, rate_hz))
    try:
        yield
    finally:
        task.cancel()


async def test_raw_image_arrives_bit_exact() -> None:
    async with pair() as hosts:
        producer, grant, _ = await hosts.export("image")
        number = await hosts.reader.import_("image", HERE, grant, Over())
        reader = await hosts.reading(number, "image")
        async with sent(producer):
            message = await reader.until()
        assert isinstance(message, Image)
        expected = noise(message.header.seq)
        assert message.to_wire()[0] == expected.to_wire()[0]
        assert bytes(message.data) == bytes(expected.data)
