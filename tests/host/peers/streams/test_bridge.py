"""Streams between two bridges: what arrives, how often it is sent, and how it ends."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from benchmarks.slow_link import slow_link
from tests.host.peers.streams.hosts import (
    HERE,
    NOISE,
    SHAPE,
    Over,
    Pair,
    Reader,
    bridge_of,
    forks,
    header,
    noise,
    pair,
    sent,
)
from tests.kit.processes import until_gone

from nondum.host.peers.streams.bridge import Bridge
from nondum.sdk.errors import WorkerFailed
from nondum.sdk.messages import (
    BoundingBox2D,
    Depth,
    Detection,
    Detections,
    Image,
    Message,
    Points,
    Text,
    Twist,
)
from nondum.sdk.streams import Producer
from nondum.transport import link_sockets

pytestmark = pytest.mark.anyio

Pixels = np.ndarray[Any, np.dtype[Any]]
Raster = Callable[[int], Image | Depth]

ROWS, COLUMNS = np.mgrid[: SHAPE[0], : SHAPE[1]]
SCENE = np.stack(
    [120 + 100 * np.sin(ROWS / 17), 120 + 100 * np.cos(COLUMNS / 23), (ROWS + COLUMNS) % 256], 2
).astype(np.uint8)


def padded(seq: int) -> Image:
    """Its rows are longer than their pixels."""
    rows = np.concatenate([NOISE.reshape(SHAPE[0], -1), np.zeros((SHAPE[0], 5), np.uint8)], 1)
    data = rows.tobytes()
    return Image(header(seq), SHAPE[0], SHAPE[1], "bgr8", rows.shape[1], data)


def scene(seq: int, encoding: str = "bgr8") -> Image:
    pixels = {"mono8": SCENE[..., 0], "mono16": SCENE[..., 0].astype("<u2")}.get(encoding, SCENE)
    return Image.from_array(header(seq), np.ascontiguousarray(pixels), encoding)


def depth(seq: int) -> Depth:
    return Depth.from_array(header(seq), SCENE[..., 0].astype("<u2"), "16UC1")


class Camera:
    """Makes images, and can be waited for."""

    def __init__(self) -> None:
        self.seq = 0
        self._made = asyncio.Event()

    def __call__(self, seq: int) -> Image:
        self.seq = seq
        self._made.set()
        return noise(seq)

    async def has_made(self, seq: int) -> None:
        while self.seq < seq:
            self._made.clear()
            await self._made.wait()


def number_of(message: Message) -> int:
    seq: int = message.header.seq  # type: ignore[attr-defined]  # all that streams carry have it
    return seq


def after(seq: int) -> Callable[[Message], bool]:
    return lambda message: number_of(message) > seq


def pixels(message: Message) -> Pixels:
    assert isinstance(message, Image | Depth)
    return message.array()


async def read(hosts: Pair, kind: str = "image") -> tuple[Producer, Reader, Over, Over]:
    """A stream from a producer there to a reader here, and what tells of its two ends."""
    producer, grant, owner_over = await hosts.export(kind)
    reader_over = Over()
    number = await hosts.reader.import_(kind, HERE, grant, reader_over)
    return producer, await hosts.reading(number, kind), owner_over, reader_over


@pytest.mark.parametrize("make", [noise, padded, scene, depth], ids=lambda make: make.__name__)
async def test_bulk_arrives_bit_exact(make: Raster) -> None:
    async with pair() as hosts:
        producer, reader, _, _ = await read(hosts, make(0).TYPE)
        async with sent(producer, make):
            message = await reader.until()
    assert isinstance(message, Image | Depth)
    expected = make(message.header.seq)
    assert message.to_wire()[0] == expected.to_wire()[0]
    assert bytes(message.data) == bytes(expected.data)


SMALL: dict[str, Message] = {
    "text": Text(header(1), "grüße"),
    "twist": Twist(header(2), (0.5, 0.0, 0.0), (0.0, 0.0, 0.1)),
    "detections": Detections(
        header(3), (Detection("person", 0.9, BoundingBox2D(4.0, 5.0, 6.0, 7.0)),), 320, 240
    ),
    "points": Points.from_array(header(4), np.zeros((5, 3), np.float32)),
}


@pytest.mark.parametrize("kind", SMALL)
async def test_every_type_arrives_as_it_is(kind: str) -> None:
    async with pair() as hosts:
        producer, reader, _, _ = await read(hosts, kind)
        async with sent(producer, lambda _: SMALL[kind]):
            message = await reader.until()
    assert message.to_wire()[0] == SMALL[kind].to_wire()[0]


async def test_one_copy_crosses_for_three_readers() -> None:
    async with pair() as hosts:
        producer, grant, _ = await hosts.export("image")
        async with slow_link(grant.port) as link:
            through = replace(grant, port=link.port)
            number = await hosts.reader.import_("image", HERE, through, Over())
            readers = [await hosts.reading(number, "image", name) for name in "abc"]
            async with sent(producer):
                for reader in readers:
                    await reader.until(after(20))
            figures = await hosts.owner.figures()
            forwarded = link.forwarded
    (export,) = figures["exports"].values()
    frames = max(len(reader.messages) for reader in readers)
    assert export["frames"] <= frames + 3
    assert forwarded < (frames + 3) * NOISE.nbytes * 1.1


async def test_stopped_reader_costs_other_readers_nothing() -> None:
    async with pair() as hosts:
        producer, grant, _ = await hosts.export("image")
        number = await hosts.reader.import_("image", HERE, grant, Over())
        ours, theirs = link_sockets()  # no process ever reads from it
        with ours, theirs:
            await hosts.reader.feed(number, "stopped", theirs)
            reader = await hosts.reading(number, "image", "awake")
            async with sent(producer):
                await reader.until(after(50))


async def test_after_a_stall_newest_wins() -> None:
    """Of what was sent meanwhile, no more arrives than was under way when it began."""
    camera = Camera()
    async with pair() as hosts:
        producer, grant, _ = await hosts.export("image")
        async with slow_link(grant.port) as link:
            through = replace(grant, port=link.port)
            number = await hosts.reader.import_("image", HERE, through, Over())
            reader = await hosts.reading(number, "image")
            async with sent(producer, camera):
                await reader.until()
                link.stall()
                stalled_at = camera.seq
                await camera.has_made(stalled_at + 60)
                count = len(reader.messages)
                link.resume()
                await reader.until(after(stalled_at + 60))
                arrived = [number_of(message) for message in reader.messages[count:]]
    late = [number for number in arrived if number <= stalled_at + 60]
    assert len(late) <= 4


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "mono8"])
async def test_images_come_as_jpeg_over_a_slow_link(encoding: str) -> None:
    def make(seq: int) -> Image:
        return scene(seq, encoding)

    expected = make(0).array().astype(float)
    async with pair() as hosts:
        producer, grant, _ = await hosts.export("image")
        async with slow_link(grant.port, expected.size * 6) as link:
            through = replace(grant, port=link.port)
            number = await hosts.reader.import_("image", HERE, through, Over())
            reader = await hosts.reading(number, "image")
            async with sent(producer, make, rate_hz=30):
                message = await reader.until(
                    lambda message: not np.array_equal(pixels(message), expected)
                )
            (export,) = (await hosts.owner.figures())["exports"].values()
    assert isinstance(message, Image)
    assert export["coding"] == "jpeg"
    assert message.to_wire()[0] == make(message.header.seq).to_wire()[0]
    error = float(np.mean((message.array() - expected) ** 2))
    assert 10 * np.log10(255**2 / error) > 30


@pytest.mark.parametrize("make", [depth, lambda seq: scene(seq, "mono16")], ids=["depth", "mono16"])
async def test_sixteen_bits_stay_exact_over_a_slow_link(make: Raster) -> None:
    first = make(0)
    length = len(bytes(first.data))
    async with pair() as hosts:
        producer, grant, _ = await hosts.export(first.TYPE)
        async with slow_link(grant.port, length * 6) as link:
            through = replace(grant, port=link.port)
            number = await hosts.reader.import_(first.TYPE, HERE, through, Over())
            reader = await hosts.reading(number, first.TYPE)
            async with sent(producer, make, rate_hz=60):
                await reader.until(after(150))
    for message in reader.messages:
        assert isinstance(message, Image | Depth)
        assert bytes(message.data) == bytes(first.data)


async def test_stalled_network_ends_the_stream_at_its_reader() -> None:
    async with pair() as hosts:
        producer, grant, owner_over = await hosts.export("image")
        async with slow_link(grant.port) as link:
            through, reader_over = replace(grant, port=link.port), Over()
            number = await hosts.reader.import_("image", HERE, through, reader_over)
            reader = await hosts.reading(number, "image")
            async with sent(producer):
                await reader.until()
                link.stall()
                assert await reader_over.code() == "STREAM_SILENT"
                await asyncio.wait_for(reader.ended.wait(), 30)
                assert reader.violation is None
                assert await owner_over.code() in {"STREAM_SILENT", "STREAM_LOST"}


async def test_slow_link_is_no_dead_one() -> None:
    """A frame takes longer than silence may last, but its bytes trickle."""
    async with pair() as hosts:
        producer, grant, _ = await hosts.export("depth")
        async with slow_link(grant.port, SCENE[..., 0].size * 2 / 3) as link:
            through, over = replace(grant, port=link.port), Over()
            number = await hosts.reader.import_("depth", HERE, through, over)
            reader = await hosts.reading(number, "depth")
            async with sent(producer, depth):
                await reader.until()
                await reader.until()


async def test_end_of_the_producer_ends_the_stream() -> None:
    async with pair() as hosts:
        producer, reader, owner_over, reader_over = await read(hosts)
        async with sent(producer):
            await reader.until()
        producer.close()
        assert await owner_over.code() == "STREAM_ENDED"
        assert await reader_over.code() == "STREAM_ENDED"
        await asyncio.wait_for(reader.ended.wait(), 30)


async def test_withdrawn_reader_is_cut() -> None:
    async with pair() as hosts:
        _, _, _, reader_over = await read(hosts)
        async with hosts.reader.kept() as key:
            await hosts.owner.withdraw(key)
        assert await reader_over.code() == "STREAM_ENDED"
        assert (await hosts.owner.figures())["exports"] == {}


@pytest.mark.parametrize("side", ["owner", "reader"])
async def test_killed_bridge_ends_its_streams_and_a_new_one_serves(side: str) -> None:
    async with pair() as hosts:
        _, reader, owner_over, reader_over = await read(hosts)
        killed: Bridge = getattr(hosts, side)
        assert killed.pid is not None
        os.kill(killed.pid, signal.SIGKILL)
        assert await owner_over.code() in {"BRIDGE_DIED", "STREAM_LOST"}
        assert await reader_over.code() in {"BRIDGE_DIED", "STREAM_LOST"}
        await asyncio.wait_for(reader.ended.wait(), 30)
        producer, again, _, _ = await read(hosts)
        async with sent(producer):
            await again.until()


async def test_stopped_bridge_is_noticed_by_both() -> None:
    async with pair() as hosts:
        _, _, _, reader_over = await read(hosts)
        assert hosts.owner.pid is not None
        os.kill(hosts.owner.pid, signal.SIGSTOP)
        assert await reader_over.code() == "STREAM_SILENT"
        os.kill(hosts.owner.pid, signal.SIGKILL)


async def test_bridge_of_a_stranger_gets_nothing() -> None:
    async with pair() as hosts, bridge_of(hosts.forks) as stranger:
        _, grant, _ = await hosts.export("image")
        with pytest.raises(WorkerFailed, match="STREAM_NOT_GRANTED"):
            await stranger.import_("image", HERE, grant, Over())
        await hosts.reader.import_("image", HERE, grant, Over())


async def test_bridge_with_a_grant_gets_no_other_stream() -> None:
    async with pair() as hosts, bridge_of(hosts.forks) as other:
        _, theirs, _ = await hosts.export("image")
        _, own, _ = await hosts.export("depth", reader=other)
        with pytest.raises(WorkerFailed, match="STREAM_NOT_GRANTED"):
            await other.import_("image", HERE, theirs, Over())
        await other.import_("depth", HERE, own, Over())


async def test_wrong_type_is_refused() -> None:
    async with pair() as hosts:
        _, grant, _ = await hosts.export("depth")
        with pytest.raises(WorkerFailed, match="STREAM_TYPE"):
            await hosts.reader.import_("image", HERE, grant, Over())


async def test_first_address_that_works_is_taken() -> None:
    async with pair() as hosts:
        producer, grant, _ = await hosts.export("image")
        addresses = ("tcp://192.0.2.1:7410", "tcp://[::1]:7410", *HERE)
        number = await hosts.reader.import_("image", addresses, grant, Over())
        reader = await hosts.reading(number, "image")
        async with sent(producer):
            await reader.until()


async def test_address_without_a_listener_is_told() -> None:
    async with pair() as hosts:
        _, grant, _ = await hosts.export("image")
        with pytest.raises(WorkerFailed, match="STREAM_"):
            await hosts.reader.import_("image", HERE, replace(grant, port=1), Over())
        with pytest.raises(WorkerFailed, match="STREAM_UNREACHABLE"):
            await hosts.reader.import_("image", (), grant, Over())


async def test_port_may_be_given_and_is_taken_once() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    async with (
        forks() as client,
        bridge_of(client, port=port) as one,
        bridge_of(client, port=port) as other,
    ):
        ours, theirs = link_sockets()
        with ours, theirs:
            async with one.kept() as key:
                assert (await one.export("image", theirs, key, Over())).port == port
        with pytest.raises(WorkerFailed, match="ADDRESS_UNUSABLE"):
            async with other.kept():
                pass
        assert other.pid is None


async def test_nothing_runs_without_streams() -> None:
    async with pair(idle_s=0.1) as hosts:
        assert hosts.owner.pid is None
        assert await hosts.owner.figures() == {"exports": {}, "imports": {}}
        assert hosts.owner.pid is None
        _, grant, _ = await hosts.export("image")
        pid = hosts.owner.pid
        assert pid is not None
        await hosts.owner.unexport(grant.token)
        await until_gone(pid)
        assert hosts.owner.pid is None


async def test_idle_bridge_waits_for_its_last_stream() -> None:
    async with pair(idle_s=0.5) as hosts:
        producer, reader, owner_over, _ = await read(hosts)
        pids = hosts.owner.pid, hosts.reader.pid
        async with sent(producer):
            await reader.until(after(30))
        assert (hosts.owner.pid, hosts.reader.pid) == pids
        producer.close()
        await owner_over.code()
        for pid in pids:
            assert pid is not None
            await until_gone(pid)
