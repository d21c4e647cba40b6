"""What comes of a stream of another host is of the type that was asked for, or ends it."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from tests.transport.streams.ends import Owner, owner, within

from nondum.host.peers.streams.inbound import Inbound
from nondum.sdk.errors import Problem, WorkerFailed
from nondum.transport.peers.keys import HostKeys
from nondum.transport.streams import Coding

pytestmark = pytest.mark.anyio

READER = HostKeys.generate()
HEADER: dict[str, Any] = {"encoding": "rgb8", "width": 6, "height": 4, "step": 18}


def inbound(host: Owner, granted: Any, kind: str, over: asyncio.Future[Problem]) -> Inbound:
    return Inbound(host.context, READER, host.place(granted), kind, over.set_result)


async def test_stream_of_another_type_than_was_asked_for_is_refused() -> None:
    async with owner() as host:
        over: asyncio.Future[Problem] = asyncio.get_running_loop().create_future()
        reading = inbound(host, host.grant(READER, "depth"), "image", over)
        with pytest.raises(WorkerFailed, match="STREAM_TYPE"):
            await within(reading.opened)
        reading.close()


@pytest.mark.parametrize(
    ("kind", "bulk"), [("depth", b"\xff\xd8\xff\xe0"), ("image", None)], ids=["depth", "no bulk"]
)
async def test_only_images_with_pixels_come_as_jpeg(kind: str, bulk: bytes | None) -> None:
    async with owner() as host:
        granted = host.grant(READER, kind)
        over: asyncio.Future[Problem] = asyncio.get_running_loop().create_future()
        reading = inbound(host, granted, kind, over)
        await within(reading.opened)
        granted.outgoing.send(Coding.JPEG, HEADER, bulk)
        assert (await within(over)).code == "JPEG_INVALID"
        reading.close()
