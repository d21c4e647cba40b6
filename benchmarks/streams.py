"""Camera frames between processes, against ZeroMQ ipc: `python -m benchmarks.streams`.

Frames of 921,600 bytes (640×480, bgr8) to one and to three readers, all designs in one run, repeat
by repeat in turn: paced at 30 Hz for latency and CPU, and as fast as the slowest reader takes them
for throughput. Every reader ends up with an `Image` and reads all its pixels. Beside them is the
least that processes can do: a ring of shared memory, a packet for each frame, readers that block,
nothing released and nothing checked. Writes docs/benchmarks/streams.md.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import mmap
import os
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import msgpack
import numpy as np  # before anything is measured: reading the pixels imports it
import zmq
from benchmarks import measuring
from benchmarks.measuring import Spread

from nondum.sdk import Header, Image
from nondum.sdk.packets import SocketPackets
from nondum.sdk.streams import Consumer, Producer
from nondum.sdk.wire import MAX_PACKET

WIDTH, HEIGHT = 640, 480
RATE_HZ = 30
HIGH_WATER_MARK = 16
WINDOW = 2
"""Frames under way in the throughput runs."""
READERS = (1, 3)
RING = struct.Struct("<Qd")
"""A frame of the bare ring: its number, and when it was made."""
RING_SLOTS = 4
FRAMES = tuple(bytes([shade]) * (WIDTH * HEIGHT * 3) for shade in range(4))

Send = Callable[[Image], None]


def frame(seq: int) -> Image:
    """The next frame of the camera."""
    header = Header(frame_id="camera", seq=seq)
    return Image(header, HEIGHT, WIDTH, "bgr8", WIDTH * 3, FRAMES[seq % len(FRAMES)])


# What each reader process does.


class Notes:
    """What a reader saw; acknowledged frame by frame."""

    def __init__(self, acknowledge: int) -> None:
        self._acknowledge = acknowledge
        self._latencies_us: list[float] = []
        self._begun_s = 0.0

    def take(self, image: Image) -> None:
        if not self._latencies_us:
            self._begun_s = time.process_time()
        assert np.max(image.array()) == image.header.seq % len(FRAMES)
        self._latencies_us.append((time.monotonic() - image.header.stamp_s) * 1e6)
        os.write(self._acknowledge, b".")

    def report(self) -> None:
        cpu_s = time.process_time() - self._begun_s
        print(json.dumps({"latencies_us": self._latencies_us, "cpu_s": cpu_s}), flush=True)


async def read_slots(notes: Notes, descriptor: int) -> None:
    over = asyncio.Event()

    def take() -> None:
        message = consumer.take()
        assert isinstance(message, Image)
        notes.take(message)

    packets = SocketPackets(socket.socket(fileno=descriptor), MAX_PACKET)
    consumer = Consumer("image", packets, take, lambda violation: over.set())
    print("ready", flush=True)
    await over.wait()


def read_zmq(notes: Notes, address: str, *, copy: bool) -> None:
    subscriber: zmq.Socket[bytes] = zmq.Context.instance().socket(zmq.SUB)
    subscriber.setsockopt(zmq.RCVHWM, HIGH_WATER_MARK)
    subscriber.setsockopt(zmq.SUBSCRIBE, b"")
    subscriber.connect(address)
    print("ready", flush=True)
    while True:
        packed, data = subscriber.recv_multipart(0, copy)
        header = msgpack.unpackb(packed.buffer if isinstance(packed, zmq.Frame) else packed)
        if header is None:
            break
        pixels = data.buffer if isinstance(data, zmq.Frame) else data
        notes.take(Image.from_wire(header, pixels))
    subscriber.close(linger=0)


def read_ring(notes: Notes, descriptors: list[int]) -> None:
    packets, *slots = descriptors
    sock = socket.socket(fileno=packets)
    memory = [memoryview(mmap.mmap(slot, 0, prot=mmap.PROT_READ)) for slot in slots]
    print("ready", flush=True)
    while packet := sock.recv(RING.size):
        seq, stamp_s = RING.unpack(packet)
        header = Header(stamp_s=stamp_s, frame_id="camera", seq=seq)
        notes.take(Image(header, HEIGHT, WIDTH, "bgr8", WIDTH * 3, memory[seq % RING_SLOTS]))


def read(kind: str, where: str, acknowledge: int) -> None:
    notes = Notes(acknowledge)
    if kind == "slots":
        asyncio.run(read_slots(notes, int(where)))
    elif kind == "ring":
        read_ring(notes, [int(descriptor) for descriptor in where.split(",")])
    else:
        read_zmq(notes, where, copy=kind == "zmq-copy")
    notes.report()


# What the producing process does.


class Readers:
    """The reader processes of one run."""

    def __init__(self, stack: contextlib.ExitStack) -> None:
        self._stack = stack
        self._processes: list[subprocess.Popen[str]] = []
        self._acknowledged: list[int] = []

    def start(self, kind: str, where: str, *descriptors: int) -> None:
        reading, writing = os.pipe()
        command = [sys.executable, "-m", "benchmarks.streams", "--read", kind, where, str(writing)]
        process = self._stack.enter_context(
            subprocess.Popen(
                command, pass_fds=(*descriptors, writing), stdout=subprocess.PIPE, text=True
            )
        )
        os.close(writing)
        self._stack.callback(os.close, reading)
        self._stack.callback(process.kill)
        assert self._output(process).readline() == "ready\n"
        self._processes.append(process)
        self._acknowledged.append(reading)

    async def all_have_read(self) -> None:
        """Wait until every reader has acknowledged one more frame."""
        loop = asyncio.get_running_loop()
        for descriptor in self._acknowledged:
            arrived = asyncio.Event()
            loop.add_reader(descriptor, arrived.set)
            await arrived.wait()
            loop.remove_reader(descriptor)
            os.read(descriptor, 1)

    def reports(self) -> list[dict[str, Any]]:
        return [json.loads(self._output(process).read()) for process in self._processes]

    @staticmethod
    def _output(process: subprocess.Popen[str]) -> IO[str]:
        assert process.stdout is not None
        return process.stdout


@contextlib.contextmanager
def by_slots(readers: Readers, count: int) -> Iterator[Send]:
    producer = Producer("image")
    for number in range(count):
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        producer.connect(f"reader {number}", SocketPackets(ours, MAX_PACKET))
        readers.start("slots", str(theirs.fileno()), theirs.fileno())
        theirs.close()
    yield producer.send
    producer.close()


@contextlib.contextmanager
def by_ring(readers: Readers, count: int) -> Iterator[Send]:
    size = WIDTH * HEIGHT * 3
    slots = [os.memfd_create("ring") for _ in range(RING_SLOTS)]
    for slot in slots:
        os.truncate(slot, size)
    memory = [mmap.mmap(slot, size) for slot in slots]
    ends = []
    for _ in range(count):
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        descriptors = (theirs.fileno(), *slots)
        readers.start("ring", ",".join(map(str, descriptors)), *descriptors)
        theirs.close()
        ends.append(ours)

    def send(image: Image) -> None:
        seq = image.header.seq
        memory[seq % RING_SLOTS][:] = image.data
        packet = RING.pack(seq, image.header.stamp_s)
        for end in ends:
            end.send(packet)

    yield send
    for end in ends:
        end.close()
    for slot in slots:
        os.close(slot)


@contextlib.contextmanager
def by_zmq(readers: Readers, count: int, *, copy: bool) -> Iterator[Send]:
    with tempfile.TemporaryDirectory() as folder:
        publisher: zmq.Socket[bytes] = zmq.Context.instance().socket(zmq.XPUB)
        publisher.setsockopt(zmq.SNDHWM, HIGH_WATER_MARK)
        publisher.setsockopt(zmq.XPUB_VERBOSE, 1)  # tell every reader's subscription
        address = f"ipc://{Path(folder) / 'frames'}"
        publisher.bind(address)
        for _ in range(count):
            readers.start("zmq-copy" if copy else "zmq", address)
        for _ in range(count):
            publisher.recv()  # the subscription has arrived: nothing will be missed

        def send(image: Image) -> None:
            header, _ = image.to_wire()
            publisher.send_multipart([msgpack.packb(header), image.data], copy=copy)

        yield send
        publisher.send_multipart([msgpack.packb(None), b""])
        publisher.close(linger=1000)


@dataclass(frozen=True, slots=True)
class Figures:
    """One repeat with one number of readers."""

    median_us: float
    p99_us: float
    producer_cpu_us: float
    reader_cpu_us: float
    """All readers together, per frame."""
    frames_s: float
    """Per reader, at the pace of the slowest."""

    @property
    def cpu_us(self) -> float:
        """Of all processes, per frame."""
        return self.producer_cpu_us + self.reader_cpu_us


async def paced(send: Send, frames: int) -> float:
    """Send at 30 Hz; give the CPU seconds used."""
    loop = asyncio.get_running_loop()
    begun_s, cpu_s = loop.time(), time.process_time()
    for seq in range(frames):
        await asyncio.sleep(begun_s + seq / RATE_HZ - loop.time())
        send(frame(seq))
    await asyncio.sleep(1 / RATE_HZ)
    return time.process_time() - cpu_s


async def unpaced(send: Send, readers: Readers, frames: int) -> float:
    """Send as fast as the slowest reader takes; give frames per second."""
    begun_s = time.monotonic()
    for seq in range(frames):
        if seq >= WINDOW:
            await readers.all_have_read()
        send(frame(seq))
    for _ in range(min(WINDOW, frames)):
        await readers.all_have_read()
    return frames / (time.monotonic() - begun_s)


Design = Callable[[Readers, int], contextlib.AbstractContextManager[Send]]


async def measure(design: Design, count: int, frames: int) -> Figures:
    with contextlib.ExitStack() as stack:
        readers = Readers(stack)
        with design(readers, count) as send:
            producer_cpu_s = await paced(send, frames)
        reports = readers.reports()
    latencies = [value for report in reports for value in report["latencies_us"]]
    with contextlib.ExitStack() as stack:
        readers = Readers(stack)
        with design(readers, count) as send:
            frames_s = await unpaced(send, readers, 10 * frames)
    return Figures(
        median_us=measuring.percentile(latencies, 50),
        p99_us=measuring.percentile(latencies, 99),
        producer_cpu_us=producer_cpu_s / frames * 1e6,
        reader_cpu_us=sum(report["cpu_s"] for report in reports) / frames * 1e6,
        frames_s=frames_s,
    )


DESIGNS: dict[str, Design] = {
    "nondum slots": by_slots,
    "ZeroMQ ipc": lambda readers, count: by_zmq(readers, count, copy=True),
    "ZeroMQ ipc, copy=False": lambda readers, count: by_zmq(readers, count, copy=False),
    "a bare ring": by_ring,
}
Found = dict[tuple[str, int], list[Figures]]


async def compare(repeats: int, frames: int) -> Found:
    found: Found = {(design, count): [] for count in READERS for design in DESIGNS}
    for _ in range(repeats):
        for design, count in found:
            found[design, count].append(await measure(DESIGNS[design], count, frames))
            print(f"{design}, {count} reader(s): {found[design, count][-1]}", file=sys.stderr)
    return found


COLUMNS = {
    "30 Hz: median µs": ("median_us", ".0f"),
    "p99 µs": ("p99_us", ",.0f"),
    "producer CPU µs per frame": ("producer_cpu_us", ".0f"),
    "readers' CPU µs per frame": ("reader_cpu_us", ".0f"),
    "all CPU µs per frame": ("cpu_us", ".0f"),
    "fastest: frames/s per reader": ("frames_s", ",.0f"),
}


def section(found: Found, count: int) -> str:
    spreads = {
        design: {
            f: Spread(tuple(getattr(one, f) for one in found[design, count]))
            for f, _ in COLUMNS.values()
        }
        for design in DESIGNS
    }
    rows = [
        [design, *(format(spread[f], style) for f, style in COLUMNS.values())]
        for design, spread in spreads.items()
    ]
    ours, *others = spreads
    for other in others:
        ratios = (measuring.ratio(spreads[ours][f], spreads[other][f]) for f, _ in COLUMNS.values())
        rows.append([f"slots ÷ {other}", *ratios])
    title = "One reader" if count == 1 else f"{count} readers"
    return f"## {title}\n\n{measuring.table(['', *COLUMNS], rows)}\n"


def page(found: Found, repeats: int, frames: int) -> str:
    sections = "\n".join(section(found, count) for count in READERS)
    return f"""# Frames on one host: shared slots against ZeroMQ ipc

`python -m benchmarks.streams` wrote this page. Frames of {WIDTH * HEIGHT * 3:,} bytes from one
process to others. Latency runs from the frame's stamp, set just before it is sent, to the moment
the reader has an `Image` and has read all its pixels once. {repeats} repeats in turn of {frames}
frames at {RATE_HZ} Hz and {10 * frames} at most {WINDOW} ahead of the slowest reader; medians of
the repeats (lowest-highest).
ZeroMQ: XPUB and SUB, two parts, high-water mark {HIGH_WATER_MARK}, readers that block; the readers
of slots run an asyncio loop, as workers do. The bare ring is the least that such processes take:
shared memory, a packet for each frame, readers that block, nothing released and nothing checked.

{sections}
Machine: {measuring.machine()}; pyzmq {zmq.__version__}, libzmq {zmq.zmq_version()}.
p99 mostly shows what else the machine was doing; compare medians and ratios.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--frames", type=int, default=90)
    parser.add_argument("--read", nargs=3, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.read:
        kind, where, acknowledge = arguments.read
        read(kind, where, int(acknowledge))
        return
    found = asyncio.run(compare(arguments.repeats, arguments.frames))
    measuring.write("streams", page(found, arguments.repeats, arguments.frames))


if __name__ == "__main__":
    main()
