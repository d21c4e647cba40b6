"""Streams between real processes: newest wins, and no consumer can hurt the producer."""

from __future__ import annotations

import asyncio
import errno
import fcntl
import mmap
import os
import resource
import signal
import socket
import sys
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest
from tests.kit.golden import Golden
from tests.kit.until import until_async

from nondum.sdk import Header, Image, MessageInvalid, ProtocolViolation, Text
from nondum.sdk.packets import MemoryPackets, SocketPackets
from nondum.sdk.slots import MAX_SLOTS, SEALS, MappedSlots, Slot, SlotRing
from nondum.sdk.streams import LENT, OUTSTANDING, Consumer, Producer
from nondum.sdk.wire import MAX_PACKET, pack

pytestmark = pytest.mark.anyio

SIDE = 200  # 40,000 bytes: in a slot

READER = """
import asyncio, socket, sys
from nondum.sdk.packets import MemoryPackets, SocketPackets
from nondum.sdk.streams import Consumer

async def main(descriptor):
    over = asyncio.Event()
    def take():
        message = consumer.take()
        same = len(set(bytes(message.data))) == 1
        print(message.header.seq, message.data[0], same, flush=True)
    packets = SocketPackets(socket.socket(fileno=descriptor), 65536)
    consumer = Consumer("image", packets, take, lambda violation: over.set())
    print("ready", flush=True)
    await over.wait()
    print("over", flush=True)

asyncio.run(main(int(sys.argv[1])))
"""


def image(seq: int, side: int = SIDE) -> Image:
    data = bytes([seq % 256]) * (side * side)
    return Image(Header(frame_id="camera", seq=seq), side, side, "mono8", side, data)


def pair() -> tuple[SocketPackets, socket.socket]:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    return SocketPackets(ours, MAX_PACKET), theirs


class Reader:
    """A consumer in a separate process, which prints what it reads."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process

    @classmethod
    async def start(cls, producer: Producer, name: str = "reader") -> Reader:
        ours, theirs = pair()
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-c",
            READER,
            str(theirs.fileno()),
            pass_fds=[theirs.fileno()],
            stdout=asyncio.subprocess.PIPE,
        )
        theirs.close()
        producer.connect(name, ours)
        reader = cls(process)
        assert await reader.line() == ["ready"]
        return reader

    async def line(self) -> list[str]:
        assert self._process.stdout is not None
        return (await asyncio.wait_for(self._process.stdout.readline(), 60)).decode().split()

    def signal(self, number: int) -> None:
        self._process.send_signal(number)

    async def end(self) -> None:
        if self._process.returncode is None:
            self._process.kill()
        await self._process.communicate()


class Source(Producer):
    """A producer of images that can be waited on."""

    def __init__(self) -> None:
        super().__init__("image", on_lost=lambda consumer: self.lost.put_nowait(consumer))
        self.lost: asyncio.Queue[str] = asyncio.Queue()


@pytest.fixture
async def producer() -> AsyncIterator[Source]:
    producer = Source()
    yield producer
    producer.close()


@pytest.fixture
async def reader(producer: Source) -> AsyncIterator[Reader]:
    reader = await Reader.start(producer)
    yield reader
    await reader.end()


async def test_frames_cross_processes_unchanged(producer: Source, reader: Reader) -> None:
    for seq in range(20):
        producer.send(image(seq))
        assert await reader.line() == [str(seq), str(seq), "True"]


async def test_producer_that_closes_ends_the_stream(producer: Source, reader: Reader) -> None:
    producer.close()
    assert await reader.line() == ["over"]


async def test_stopped_consumer_costs_the_producer_nothing(
    producer: Source, reader: Reader
) -> None:
    other = await Reader.start(producer, "other")
    try:
        reader.signal(signal.SIGSTOP)
        for seq in range(1, 101):
            producer.send(image(seq))
            assert await other.line() == [str(seq), str(seq), "True"]
        assert slots_of(producer) <= 2 * OUTSTANDING + 2
        reader.signal(signal.SIGCONT)
        seen = [int((await reader.line())[0])]
        while seen[-1] != 100:
            await asyncio.sleep(0)
            seen.append(int((await reader.line())[0]))
        assert seen == sorted(set(seen))
        assert len(seen) <= OUTSTANDING + 1, "old frames were dropped, the newest came"
    finally:
        await other.end()


async def test_killed_consumer_gives_its_slots_back(producer: Source, reader: Reader) -> None:
    other = await Reader.start(producer, "other")
    try:
        reader.signal(signal.SIGSTOP)
        for seq in range(10):
            producer.send(image(seq))
            await other.line()
        assert producer.slots_held >= OUTSTANDING
        reader.signal(signal.SIGKILL)
        assert await producer.lost.get() == "reader"
        assert producer.consumers == ("other",)
        producer.send(image(99))
        assert await other.line() == ["99", "99", "True"]
        await until_async("the slots of both readers", lambda: producer.slots_held == 0)
    finally:
        await other.end()


async def test_frames_may_change_their_size(producer: Source, reader: Reader) -> None:
    for seq, side in enumerate([200, 300, 150, 500, 200, 10, 400] * 4):
        producer.send(image(seq, side))
        assert await reader.line() == [str(seq), str(seq), "True"]
    assert slots_of(producer) <= OUTSTANDING + 2


async def test_sending_without_a_reader_costs_nothing(producer: Source) -> None:
    producer.send(image(1))
    assert slots_of(producer) == 0


async def test_wrong_messages_never_leave(producer: Source) -> None:
    with pytest.raises(MessageInvalid, match="expected 4 bytes"):
        producer.send(Image(Header(), 2, 2, "mono8", 2, b"abc"))


async def test_headers_that_fit_no_packet_never_leave() -> None:
    producer, packets = Producer("text"), pair()
    producer.connect("reader", packets[0])
    with pytest.raises(MessageInvalid, match="MESSAGE_TOO_LONG"):
        producer.send(Text(Header(), "x" * MAX_PACKET))
    producer.close()
    packets[1].close()


@pytest.mark.parametrize(
    "packet",
    [b"garbage", pack([99]), pack([]), pack(["1"]), pack([1, 1])],
    ids=["garbage", "not outstanding", "empty", "text", "too many"],
)
async def test_producer_cuts_hostile_consumers_off(producer: Source, packet: bytes) -> None:
    ours, theirs = pair()
    producer.connect("hostile", ours)
    producer.send(image(1))
    theirs.send(packet)
    assert await producer.lost.get() == "hostile"
    assert producer.slots_held == 0
    theirs.close()


async def test_releasing_twice_is_cut_off(producer: Source) -> None:
    ours, theirs = pair()
    producer.connect("hostile", ours)
    for seq in range(3):
        producer.send(image(seq))
    theirs.send(pack([1]))
    theirs.send(pack([1]))
    assert await producer.lost.get() == "hostile"
    theirs.close()


def slots_of(producer: Producer) -> int:
    return len(producer._ring)


class Listener:
    """A consumer in this process, for producers that lie."""

    def __init__(self, kind: str = "image") -> None:
        packets, self.raw = pair()
        self.lost: asyncio.Future[ProtocolViolation | None]
        self.lost = asyncio.get_running_loop().create_future()
        self.arrived = asyncio.Event()
        self.consumer = Consumer(kind, packets, self.arrived.set, self.lost.set_result)

    async def verdict(self) -> str:
        violation = await asyncio.wait_for(self.lost, 30)
        self.raw.close()
        return violation.code if violation else "closed"


def header(side: int = SIDE) -> dict[str, Any]:
    return image(1, side).to_wire()[0]


def memory(size: int, seals: int = SEALS, *, holes: int = 0) -> int:
    """Sealed memory, but for its last bytes really there."""
    descriptor = os.memfd_create("test", os.MFD_ALLOW_SEALING)
    os.ftruncate(descriptor, size)
    if size > holes:
        os.posix_fallocate(descriptor, 0, size - holes)
    fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, seals)
    return descriptor


def a_pipe() -> int:
    reading, writing = os.pipe()
    os.close(writing)
    return reading


LIES: dict[str, tuple[Any, Callable[[], int] | None, str]] = {
    "no packet": ([7], None, "STREAM_PACKET"),
    "no list": ({"a": 1}, None, "STREAM_PACKET"),
    "unknown slot": ([1, 1, 5, 10, {}], None, "SLOT_UNKNOWN"),
    "length beyond slot": ([1, 1, 5, 5000, {}], lambda: memory(4096), "SLOT_LENGTH"),
    "negative length": ([1, 1, 5, -1, {}], lambda: memory(4096), "SLOT_LENGTH"),
    "no seals": ([1, 1, 5, 10, {}], lambda: memory(4096, 0), "SLOT_SEALS"),
    "may shrink": ([1, 1, 5, 10, {}], lambda: memory(4096, fcntl.F_SEAL_GROW), "SLOT_SEALS"),
    "empty memory": ([1, 1, 5, 0, {}], lambda: memory(0), "SLOT_SIZE"),
    "all holes": ([1, 1, 5, 10, {}], lambda: memory(1 << 20, holes=1 << 20), "SLOT_HOLES"),
    "one page is not there": (
        [1, 1, 5, 10, {}],
        lambda: memory(1 << 20, holes=mmap.PAGESIZE),
        "SLOT_HOLES",
    ),
    "a pipe": ([1, 1, 5, 10, {}], a_pipe, "SLOT_SEALS"),
    "a file": ([1, 1, 5, 10, {}], lambda: os.open(__file__, os.O_RDONLY), "SLOT_SEALS"),
    "memory with inline": ([0, 1, {}, b"x"], lambda: memory(4096), "PACKET_DESCRIPTORS"),
}


@pytest.mark.parametrize(("packet", "make", "code"), LIES.values(), ids=LIES)
async def test_lying_producer_is_cut_off(
    packet: Any, make: Callable[[], int] | None, code: str
) -> None:
    listener = Listener()
    descriptors = [make()] if make else []
    socket.send_fds(listener.raw, [pack(packet)], descriptors)
    for descriptor in descriptors:
        os.close(descriptor)
    assert await listener.verdict() == code


@pytest.mark.parametrize("length", [1, mmap.PAGESIZE, mmap.PAGESIZE + 1, 1_000_003])
def test_slot_is_there_whole_once_it_was_written_to(length: int) -> None:
    ring = SlotRing()
    slot = ring.write((bytes(length),), length)
    assert slot is not None
    found = os.fstat(slot.descriptor)
    assert found.st_blocks * 512 >= found.st_size == slot.size
    ring.close()


async def test_too_many_slots_are_cut_off() -> None:
    listener = Listener()
    descriptor = memory(4096)
    loop = asyncio.get_running_loop()
    listener.raw.setblocking(False)
    for slot in range(MAX_SLOTS + 1):
        socket.send_fds(listener.raw, [pack([1, slot, slot, 1, {}])], [descriptor])
        if slot:
            await loop.sock_recv(listener.raw, 100)  # the release of the one before
    os.close(descriptor)
    assert await listener.verdict() == "SLOT_UNKNOWN"


async def test_message_that_is_none_is_refused_when_taken() -> None:
    listener = Listener()
    listener.raw.send(pack([0, 1, header(), b"short"]))
    await listener.arrived.wait()
    with pytest.raises(MessageInvalid):
        listener.consumer.take()
    listener.consumer.close()
    listener.raw.close()


async def test_slot_taken_away_is_refused_when_taken() -> None:
    listener = Listener()
    descriptor = memory(SIDE * SIDE)
    socket.send_fds(listener.raw, [pack([1, 1, 1, SIDE * SIDE, header()])], [descriptor])
    listener.raw.send(pack([2, 1]))
    os.close(descriptor)
    await listener.arrived.wait()
    await asyncio.sleep(0)
    with pytest.raises(ProtocolViolation, match="SLOT_UNKNOWN"):
        listener.consumer.take()
    listener.consumer.close()
    listener.raw.close()


async def test_long_frame_crosses_where_no_memory_is_shared(producer: Source) -> None:
    ours, theirs = MemoryPackets.pair()
    arrived = asyncio.Event()
    consumer = Consumer("image", theirs, arrived.set, lambda violation: None)
    producer.connect("bench", ours)
    producer.send(image(7, side=300))  # longer than a packet of a socket
    await asyncio.wait_for(arrived.wait(), 30)
    message = consumer.take()
    assert isinstance(message, Image)
    assert message.header.seq == 7
    consumer.close()


async def test_kept_frames_neither_change_nor_stop_the_stream(producer: Source) -> None:
    ours, theirs = pair()
    producer.connect("keeper", ours)
    arrived = asyncio.Event()
    packets = SocketPackets(theirs, MAX_PACKET)
    consumer = Consumer("image", packets, arrived.set, lambda violation: None)
    kept: list[Image] = []
    for seq in range(10):
        producer.send(image(seq))
        await asyncio.wait_for(arrived.wait(), 30)
        arrived.clear()
        message = consumer.take()
        assert isinstance(message, Image)
        kept.append(message)
    assert [set(bytes(message.data)) for message in kept] == [{seq} for seq in range(10)]
    assert [isinstance(message.data, memoryview) for message in kept[:3]] == [True, True, False]
    assert all(not message.array().flags.writeable for message in kept)
    assert LENT <= producer.slots_held <= OUTSTANDING, "the last release may be under way"
    rows = kept[0].array()[1:3]
    consumer.close()
    producer.close()
    del message, kept
    assert rows.max() == 0, "a view outlives its stream"


async def test_frames_let_go_in_other_threads_are_released(producer: Source) -> None:
    ours, theirs = pair()
    producer.connect("thread", ours)
    arrived = asyncio.Event()
    packets = SocketPackets(theirs, MAX_PACKET)
    consumer = Consumer("image", packets, arrived.set, lambda violation: None)
    for seq in range(20):
        producer.send(image(seq))
        await asyncio.wait_for(arrived.wait(), 30)
        arrived.clear()
        held = [consumer.take()]
        await asyncio.to_thread(held.clear)
    assert slots_of(producer) <= OUTSTANDING + 2
    consumer.close()


def test_slots_are_sealed_before_they_are_handed_over() -> None:
    slot = Slot(1, mmap.PAGESIZE)
    slot.memory[:5] = b"first"
    with pytest.raises(PermissionError):
        os.ftruncate(slot.descriptor, 0)
    with pytest.raises(PermissionError):
        os.ftruncate(slot.descriptor, 2 * mmap.PAGESIZE)
    with pytest.raises(PermissionError):
        os.pwrite(slot.descriptor, b"x", 0)
    with pytest.raises(PermissionError):
        mmap.mmap(slot.descriptor, mmap.PAGESIZE)
    with pytest.raises(PermissionError):
        fcntl.fcntl(slot.descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_WRITE)
    reader = MappedSlots()
    reader.add(1, os.dup(slot.descriptor))
    slot.memory[:5] = b"later"
    assert reader.copy(1, 5) == b"later"
    reader.close()
    slot.close()


def test_ring_uses_no_slot_that_is_read() -> None:
    ring = SlotRing()
    first = ring.write((b"a" * 100,), 100)
    assert first is not None
    first.readers = 1
    second = ring.write((b"b" * 100,), 100)
    assert second is not None and second is not first
    assert first.memory[:1] == b"a"
    first.readers = 0
    assert list(ring.retire(keep=1)) == [first.id]
    ring.close()


CROWDED = """
import asyncio, ctypes, os, resource, socket  # all now: later it is another user
from nondum.sdk import Header, Image
from nondum.sdk.packets import SocketPackets
from nondum.sdk.streams import Consumer, Producer

if os.geteuid() == 0:  # it is counted by user, and root is not held to it
    os.setresuid(*[2_000_000 + os.getpid()] * 3)
resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64))
full, unread = socket.socketpair()
socket.send_fds(full, [b"x"], [0] * 250)

async def main():
    refused, arrived = [], asyncio.Event()
    one, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    producer = Producer("image", on_lost=lambda name: print("lost", flush=True))
    crowded = asyncio.Event()
    def on_crowded():
        refused.append(1)
        crowded.set()
    producer.connect("eye", SocketPackets(one, 65536, on_crowded=on_crowded))
    consumer = Consumer("image", SocketPackets(other, 65536), arrived.set, lambda _: None)
    producer.send(Image(Header(frame_id="c", seq=7), 300, 300, "mono8", 300, bytes(90_000)))
    await crowded.wait()
    print("is fed" if producer.consumers == ("eye",) else "is not fed", flush=True)
    for descriptor in socket.recv_fds(unread, 1, 250)[1]:
        os.close(descriptor)
    await arrived.wait()
    print("got", consumer.take().header.seq, flush=True)
    producer.close()

asyncio.run(main())
"""


async def test_frame_waits_while_too_many_descriptors_are_under_way() -> None:
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-c", CROWDED), stdout=asyncio.subprocess.PIPE
    )
    try:
        told, _ = await asyncio.wait_for(process.communicate(), 60)
    finally:
        if process.returncode is None:
            process.kill()
    assert told.decode().splitlines() == ["is fed", "got 7"]


def test_message_that_is_larger_than_a_worker_may_have_in_one_piece_is_told_with_sizes(
    golden: Golden,
) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    try:
        with pytest.raises(OSError) as caught:
            SlotRing().write((bytes(8192),), 8192)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert caught.value.errno == errno.EFBIG
    golden.check("a message is larger than a file may be", str(caught.value))
