"""A bridge that breaks the rules, or says nothing, ends the stream at its reader."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Sequence

import pytest
import zmq
from tests.kit.descriptors import descriptors_left
from tests.kit.until import arrived
from tests.transport.streams.ends import LyingOwner, Reading, owner, stalling, within

from nondum.transport.peers.keys import HostKeys
from nondum.transport.streams import Coding, Frame, Place, incoming, packets
from nondum.transport.streams.packets import Opened, Pong

pytestmark = pytest.mark.anyio

READER = HostKeys.generate()
OPENED = [packets.told(Opened("image"))]


def frame(seq: int) -> list[bytes]:
    return [packets.head(Frame(seq, Coding.RAW, {})), *map(bytes, packets.cut(bytes(600_000)))]


@contextlib.asynccontextmanager
async def reading_of(*answers: Sequence[bytes]) -> AsyncIterator[Reading]:
    """A reader of an owner that answers so."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    lying = LyingOwner(context, *answers)
    reading = Reading(context, READER, lying.place)
    reading.handles = False
    try:
        yield reading
    finally:
        reading.incoming.close()
        lying.close()
        context.term()


@pytest.mark.parametrize(
    "answers",
    [
        [OPENED, OPENED],
        [frame(1)],
        [OPENED, *(frame(seq) for seq in range(1, 9))],
        [OPENED, *[[packets.told(Pong(1.0, 2.0))]] * 100],
    ],
    ids=["opened twice", "frame before it is opened", "frames beyond the window", "pongs"],
)
async def test_message_out_of_its_turn_ends_the_stream(answers: list[list[bytes]]) -> None:
    async with reading_of(*answers) as reading:
        assert (await within(reading.over)).code == "BRIDGE_PACKET"


async def test_owner_that_does_not_answer_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(incoming, "OPEN_S", 0.2)
    async with reading_of() as reading:
        assert (await within(reading.over)).code == "STREAM_UNREACHABLE"


async def test_silent_owner_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(incoming, "SILENT_S", 0.2)
    async with reading_of(OPENED) as reading:
        assert (await within(reading.over)).code == "STREAM_SILENT"


async def test_frame_without_its_last_part_ends_the_stream(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It would grow here, part by part, and never be handed over by ZeroMQ."""
    monkeypatch.setattr(packets, "MAX_BULK", 10_000)
    async with owner() as host:
        granted = host.grant(READER)
        async with stalling(host.port, to_port=1_000_000, to_client=100_000) as port:
            reading = host.read(READER, granted, port=port)
            await within(reading.opened)
            granted.send(bytes(1_000_000))
            assert (await within(reading.over)).code == "BRIDGE_PACKET"


@pytest.mark.parametrize("left", range(3))
async def test_stream_without_descriptors_cannot_be_reached_and_leaves_nothing_open(
    left: int,
) -> None:
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    place = Place(("tcp://127.0.0.1:9", "tcp://127.0.0.1:10"), READER.public, "token")
    with context.socket(zmq.PAIR):  # the threads of the context run already
        with descriptors_left(left):
            reading = Reading(context, READER, place)
        assert (await within(reading.over)).code == "DIAL_IMPOSSIBLE"
    reading.incoming.close()
    await arrived("no socket is left", asyncio.to_thread(context.term))


async def test_address_that_is_none_is_told() -> None:
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    place = Place(("nowhere",), READER.public, "token")
    reading = Reading(context, READER, place)
    assert (await within(reading.over)).code == "ADDRESS_MALFORMED"
    reading.incoming.close()
    context.term()
