"""Whatever another host's bridge sends, ours ends that stream at most, and goes on."""

from __future__ import annotations

import asyncio
import contextlib
import io
import secrets
from collections.abc import AsyncIterator
from typing import Any

import numpy as np
import PIL.Image
import pytest
import zmq
from tests.host.peers.streams.hosts import HERE, Over, Reader, bridge_of, forks
from tests.transport.streams.ends import PATIENCE_S

from nondum.host.peers.streams.bridge import Bridge, Grant
from nondum.sdk.messages import Header, Image
from nondum.transport.peers.keys import HostKeys
from nondum.transport.streams import Coding, Exporter, Outgoing

pytestmark = pytest.mark.anyio

GOOD = Image.from_array(Header(0.5, "eye", 1), np.full((4, 6, 3), 9, np.uint8), "rgb8")
HEADER, PIXELS = GOOD.to_wire()


def jpeg(width: int = 6, height: int = 4, mode: str = "RGB") -> bytes:
    out = io.BytesIO()
    PIL.Image.new(mode, (width, height)).save(out, "JPEG")
    return out.getvalue()


def png() -> bytes:
    out = io.BytesIO()
    PIL.Image.new("RGB", (6, 4)).save(out, "PNG")
    return out.getvalue()


class Owner:
    """An exporter in this process, that sends what it likes to a bridge in another process."""

    def __init__(self) -> None:
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._keys = HostKeys.generate()
        self._exporter = Exporter(self._context, self._keys)
        self._port = 0

    async def start(self) -> None:
        self._port = await self._exporter.start(("127.0.0.1",))

    async def opened(self, bridge: Bridge, kind: str = "image") -> tuple[Outgoing, int, Over]:
        """A stream that the bridge reads."""
        token, over = secrets.token_hex(8), Over()
        async with bridge.kept() as key:
            outgoing = self._exporter.grant(token, key, kind, lambda: None, lambda _: None)
            grant = Grant(self._port, self._keys.public, token)
            return outgoing, await bridge.import_(kind, HERE, grant, over), over

    async def close(self) -> None:
        self._exporter.close()
        await asyncio.to_thread(self._context.term)


@contextlib.asynccontextmanager
async def both() -> AsyncIterator[tuple[Owner, Bridge]]:
    owner = Owner()
    await owner.start()
    try:
        async with forks() as client, bridge_of(client) as bridge:
            yield owner, bridge
    finally:
        await owner.close()


async def arrives(owner: Owner, bridge: Bridge) -> None:
    """A good image arrives, over a separate stream."""
    outgoing, number, _ = await owner.opened(bridge)
    reader = Reader("image")
    await reader.attach(bridge, number, "eye")
    outgoing.send(Coding.RAW, HEADER, PIXELS)
    message = await reader.until()
    assert isinstance(message, Image)
    assert bytes(message.data) == bytes(GOOD.data)
    reader.close()


Frame = tuple[Coding, dict[str, Any], bytes | None]
BAD: dict[str, tuple[str, Frame]] = {
    "no-header": ("image", (Coding.RAW, {}, b"")),
    "no-bulk": ("image", (Coding.RAW, HEADER, None)),
    "short": ("image", (Coding.RAW, HEADER, b"short")),
    "encoding": ("image", (Coding.RAW, {**HEADER, "encoding": "rgb9"}, bytes(GOOD.data))),
    "stamp": ("image", (Coding.RAW, {**HEADER, "header": {"stamp_s": "now"}}, bytes(GOOD.data))),
    "bulk-of-text": ("text", (Coding.RAW, {"header": HEADER["header"], "text": "a"}, b"more")),
    "no-jpeg": ("image", (Coding.JPEG, HEADER, b"\xff\xd8\xff\xe0 and then nothing")),
    "empty": ("image", (Coding.JPEG, HEADER, b"")),
    "none": ("image", (Coding.JPEG, HEADER, None)),
    "cut-short": ("image", (Coding.JPEG, HEADER, jpeg()[:-40])),
    "png": ("image", (Coding.JPEG, HEADER, png())),
    "other-size": ("image", (Coding.JPEG, HEADER, jpeg(60, 40))),
    "grey": ("image", (Coding.JPEG, HEADER, jpeg(mode="L"))),
    "cmyk": ("image", (Coding.JPEG, HEADER, jpeg(mode="CMYK"))),
    "bomb": ("image", (Coding.JPEG, {**HEADER, "width": 30_000, "height": 30_000}, jpeg())),
    "negative": ("image", (Coding.JPEG, {**HEADER, "width": -6, "height": -4}, jpeg())),
    "padded": ("image", (Coding.JPEG, {**HEADER, "step": 64}, jpeg())),
    "sixteen-bits": ("image", (Coding.JPEG, {**HEADER, "encoding": "mono16"}, jpeg())),
    "depth": ("depth", (Coding.JPEG, {**HEADER, "encoding": "16UC1"}, jpeg())),
}


@pytest.mark.parametrize(("kind", "frame"), BAD.values(), ids=BAD)
async def test_bad_frame_ends_its_stream_only(kind: str, frame: Frame) -> None:
    async with both() as (owner, bridge):
        outgoing, number, over = await owner.opened(bridge, kind)
        reader = Reader(kind)
        await reader.attach(bridge, number, "eye")
        pid = bridge.pid
        outgoing.send(*frame)
        assert await over.code() in {"MESSAGE_FIELD", "MESSAGE_VALUE", "JPEG_INVALID"}
        async with asyncio.timeout(PATIENCE_S):
            await reader.ended.wait()
        assert reader.violation is None, "its readers see an end, no fault of ours"
        assert reader.messages == []
        reader.close()
        await arrives(owner, bridge)
        assert bridge.pid == pid


class Obedient:
    """What an owner's window is where it keeps none."""

    can_send = True

    def sent(self, seq: int, length: int, now_s: float) -> None: ...

    def handled(self, seq: int, now_s: float, round_trip_s: float) -> bool:
        return True


async def test_flood_of_pictures_to_restore_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    async with both() as (owner, bridge):
        outgoing, _, over = await owner.opened(bridge)
        monkeypatch.setattr(outgoing, "_window", Obedient())
        big = Image.from_array(Header(0.5), np.zeros((1000, 1000, 3), np.uint8), "rgb8")
        data = jpeg(1000, 1000)
        for _ in range(60):
            outgoing.send(Coding.JPEG, big.to_wire()[0], data)
        assert await over.code() == "BRIDGE_PACKET"
        await arrives(owner, bridge)


async def test_frame_longer_than_allowed_ends_the_connection(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with both() as (owner, bridge):
        outgoing, _, over = await owner.opened(bridge)
        outgoing.send(Coding.RAW, HEADER, bytes(65 * 1024 * 1024))
        assert await over.code() == "BRIDGE_PACKET"
        await arrives(owner, bridge)


async def test_good_jpeg_is_restored_to_what_the_header_says() -> None:
    async with both() as (owner, bridge):
        outgoing, number, _ = await owner.opened(bridge)
        reader = Reader("image")
        await reader.attach(bridge, number, "eye")
        outgoing.send(Coding.JPEG, HEADER, jpeg())
        message = await reader.until()
        assert message.to_wire()[0] == HEADER
        reader.close()


async def test_what_must_be_restored_keeps_its_place() -> None:
    async with both() as (owner, bridge):
        outgoing, number, _ = await owner.opened(bridge)
        reader = Reader("image")
        await reader.attach(bridge, number, "eye")
        for seq, coding, bulk in ((1, Coding.JPEG, jpeg()), (2, Coding.RAW, bytes(GOOD.data))):
            numbered = {**HEADER, "header": {**HEADER["header"], "seq": seq}}
            outgoing.send(coding, numbered, bulk)
        await reader.until(lambda message: message.to_wire()[0]["header"]["seq"] == 2)
        assert [message.to_wire()[0]["header"]["seq"] for message in reader.messages] == [1, 2]
        reader.close()
