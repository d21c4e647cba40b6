"""Camera frames between hosts, against ZeroMQ PUB/SUB: `python -m benchmarks.remote_streams`.

Frames of 921,600 bytes (640×480, bgr8) at 30 Hz from one process to another one over TCP on
loopback, all designs in one run, repeat by repeat in turn: first as fast as loopback is, then over
links that carry less than the frames. nondum's go worker → bridge → bridge → worker, as they do
between two hosts; ZeroMQ's straight from process to process. Writes
docs/benchmarks/remote_streams.md.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import math
import socket
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, replace
from typing import IO, Any

import msgpack
import numpy as np
import zmq
from benchmarks import measuring
from benchmarks.measuring import Spread

from nondum.host.jobs.children import Children
from nondum.host.peers.streams.bridge import Bridge
from nondum.sdk import Header, Image
from nondum.sdk.packets import SocketPackets
from nondum.sdk.streams import Consumer, Producer
from nondum.sdk.wire import MAX_PACKET
from nondum.transport import link_sockets
from nondum.transport.peers.keys import HostKeys

WIDTH, HEIGHT = 640, 480
RATE_HZ = 30
HIGH_WATER_MARK = 2
SETTLING_S = 3.0
"""Before anything is measured on a slow link: buffers fill, images become JPEG."""
LINKS = {"loopback": math.inf, "100 Mbit/s": 12.5e6, "20 Mbit/s": 2.5e6}
HERE = ("tcp://127.0.0.1:0",)

Send = Callable[[Image], None]


def scenery() -> tuple[np.ndarray[Any, np.dtype[np.uint8]], ...]:
    """Pictures with edges, gradients and some noise: neither the best nor the worst for JPEG."""
    random = np.random.default_rng(1)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    pictures = []
    for shift in range(0, 40, 10):
        plane = 110 + 60 * np.sin((rows + shift) / 31) + 50 * ((columns + shift) // 40 % 2)
        planes = np.stack([plane, plane[::-1], plane[:, ::-1]], 2)
        noise = random.normal(0, 4, planes.shape)
        pictures.append(np.clip(planes + noise, 0, 255).astype(np.uint8))
    return tuple(pictures)


# What the reading process does.


class Notes:
    """What the reader saw since it was asked to look."""

    def __init__(self) -> None:
        self._ages_us: list[float] = []
        self._from_s = math.inf

    def look(self) -> None:
        self._from_s = time.monotonic()

    def take(self, image: Image) -> None:
        int(np.max(image.array()))  # all pixels are read
        now_s = time.monotonic()
        if now_s >= self._from_s:
            self._ages_us.append((now_s - image.header.stamp_s) * 1e6)

    def report(self) -> None:
        print(json.dumps(self._ages_us), flush=True)


async def read_bridged(notes: Notes, descriptor: int) -> None:
    def take() -> None:
        message = consumer.take()
        if isinstance(message, Image):
            notes.take(message)

    packets = SocketPackets(socket.socket(fileno=descriptor), MAX_PACKET)
    consumer = Consumer("image", packets, take, lambda violation: None)
    print("ready", flush=True)
    await asyncio.to_thread(sys.stdin.readline)
    notes.look()
    await asyncio.to_thread(sys.stdin.readline)
    consumer.close()


async def read_zmq(notes: Notes, where: str) -> None:
    address, server, public, secret = json.loads(where)
    subscriber: zmq.Socket[bytes] = zmq.Context.instance().socket(zmq.SUB)
    subscriber.setsockopt(zmq.RCVHWM, HIGH_WATER_MARK)
    subscriber.setsockopt(zmq.SUBSCRIBE, b"")
    if server:
        subscriber.setsockopt(zmq.CURVE_SERVERKEY, server.encode())
        subscriber.setsockopt(zmq.CURVE_PUBLICKEY, public.encode())
        subscriber.setsockopt(zmq.CURVE_SECRETKEY, secret.encode())
    subscriber.connect(address)
    print("ready", flush=True)
    looking = asyncio.ensure_future(asyncio.to_thread(sys.stdin.readline))
    looking.add_done_callback(lambda _: notes.look())
    over = asyncio.ensure_future(_after(looking))
    while not over.done():
        if await asyncio.to_thread(subscriber.poll, 50):
            header, data = subscriber.recv_multipart(copy=False)
            notes.take(Image.from_wire(msgpack.unpackb(header.buffer), data.buffer))
    subscriber.close(linger=0)


async def _after(looking: asyncio.Future[str]) -> None:
    await looking
    await asyncio.to_thread(sys.stdin.readline)


def read(kind: str, where: str) -> None:
    notes = Notes()
    asyncio.run(read_bridged(notes, int(where)) if kind == "bridge" else read_zmq(notes, where))
    notes.report()


# What the producing process does.


class Run:
    """The processes of one run, beside this one."""

    def __init__(self, stack: contextlib.ExitStack, bytes_s: float) -> None:
        self._stack, self._bytes_s = stack, bytes_s
        self.pids: list[int] = []
        self.reader: subprocess.Popen[str]

    def link_to(self, port: int) -> int:
        """The port at which the link of this run leads to a port."""
        if math.isinf(self._bytes_s):
            return port
        module = "benchmarks.slow_link"
        link = self._start([sys.executable, "-m", module, str(port), str(self._bytes_s)])
        return int(_out(link).readline())

    def start_reader(self, kind: str, where: str, *descriptors: int) -> None:
        command = [sys.executable, "-m", "benchmarks.remote_streams", "--read", kind, where]
        self.reader = self._start(command, *descriptors)
        self.pids.append(self.reader.pid)
        assert _out(self.reader).readline() == "ready\n"

    def tell_reader(self) -> None:
        """First to look, then to stop."""
        assert self.reader.stdin is not None
        self.reader.stdin.write("\n")
        self.reader.stdin.flush()

    def ages_us(self) -> list[float]:
        ages: list[float] = json.loads(_out(self.reader).readline())
        return ages

    def cpu_s(self) -> float:
        """Of this process and all others that take part; the link is none of them."""
        return time.process_time() + sum(measuring.cpu_s(pid) for pid in self.pids)

    def _start(self, command: list[str], *descriptors: int) -> subprocess.Popen[str]:
        pipe = subprocess.PIPE
        process = self._stack.enter_context(
            subprocess.Popen(command, pass_fds=descriptors, stdin=pipe, stdout=pipe, text=True)
        )
        self._stack.callback(process.kill)
        return process


def _out(process: subprocess.Popen[str]) -> IO[str]:
    assert process.stdout is not None
    return process.stdout


@contextlib.asynccontextmanager
async def by_bridges(run: Run) -> AsyncIterator[Send]:
    children = Children()
    owner, reader = Bridge(children.forks, HERE), Bridge(children.forks, HERE)
    producer = Producer("image")
    try:
        ours, theirs = link_sockets()
        with theirs:
            async with reader.kept() as key:
                grant = await owner.export("image", theirs, key, lambda _: None)
        producer.connect("bridge", SocketPackets(ours, MAX_PACKET))
        through = replace(grant, port=run.link_to(grant.port))
        number = await reader.import_("image", HERE, through, lambda _: None)
        ours, theirs = link_sockets()
        with ours, theirs:
            await reader.feed(number, "reader", ours)
            run.start_reader("bridge", str(theirs.fileno()), theirs.fileno())
        run.pids += [pid for pid in (owner.pid, reader.pid) if pid is not None]
        yield producer.send
    finally:
        producer.close()
        await owner.close()
        await reader.close()
        await children.close()


@contextlib.asynccontextmanager
async def by_bridges_raw(run: Run) -> AsyncIterator[Send]:
    """The same bytes, called an image of 16 bits: such are never compressed."""
    async with by_bridges(run) as send:
        yield lambda image: send(replace(image, encoding="mono16", width=image.step // 2))


@contextlib.asynccontextmanager
async def by_zmq(run: Run, *, curve: bool) -> AsyncIterator[Send]:
    ours, theirs = HostKeys.generate(), HostKeys.generate()
    publisher: zmq.Socket[bytes] = zmq.Context.instance().socket(zmq.XPUB)
    publisher.setsockopt(zmq.SNDHWM, HIGH_WATER_MARK)
    if curve:
        publisher.setsockopt(zmq.CURVE_SERVER, 1)
        publisher.setsockopt(zmq.CURVE_SECRETKEY, ours.secret.encode())
    port = run.link_to(publisher.bind_to_random_port("tcp://127.0.0.1"))
    keys = (ours.public, theirs.public, theirs.secret) if curve else ("", "", "")
    run.start_reader("zmq", json.dumps([f"tcp://127.0.0.1:{port}", *keys]))
    publisher.recv()  # the subscription has arrived

    def send(image: Image) -> None:
        header, _ = image.to_wire()
        publisher.send_multipart([msgpack.packb(header), image.data], copy=False)

    yield send
    publisher.close(linger=0)


@dataclass(frozen=True, slots=True)
class Figures:
    """One repeat over one link."""

    median_us: float
    p99_us: float
    cpu_us: float
    """All processes together, per frame that was sent."""
    frames_s: float
    """That arrived."""


async def paced(send: Send, seconds: float, pictures: tuple[Any, ...]) -> int:
    """Send at 30 Hz; how many."""
    loop = asyncio.get_running_loop()
    begun_s, frames = loop.time(), round(seconds * RATE_HZ)
    for seq in range(frames):
        await asyncio.sleep(begun_s + seq / RATE_HZ - loop.time())
        header = Header(frame_id="camera", seq=seq)
        send(Image.from_array(header, pictures[seq % len(pictures)], "bgr8"))
    return frames


Design = Callable[[Run], contextlib.AbstractAsyncContextManager[Send]]


async def measure(design: Design, bytes_s: float, seconds: float) -> Figures:
    pictures = scenery()
    with contextlib.ExitStack() as stack:
        run = Run(stack, bytes_s)
        async with design(run) as send:
            await paced(send, 1.0 if math.isinf(bytes_s) else SETTLING_S, pictures)
            run.tell_reader()
            begun_s, cpu_s = time.monotonic(), run.cpu_s()
            frames = await paced(send, seconds, pictures)
            cpu_s, seconds = run.cpu_s() - cpu_s, time.monotonic() - begun_s
            run.tell_reader()
            ages = await asyncio.to_thread(run.ages_us)
    return Figures(
        median_us=measuring.percentile(ages, 50),
        p99_us=measuring.percentile(ages, 99),
        cpu_us=cpu_s / frames * 1e6,
        frames_s=len(ages) / seconds,
    )


OURS, CURVE = "nondum bridges", "ZeroMQ PUB/SUB, CURVE"
DESIGNS: dict[str, Design] = {
    OURS: by_bridges,
    "the same, raw only": by_bridges_raw,
    CURVE: lambda run: by_zmq(run, curve=True),
    "ZeroMQ PUB/SUB": lambda run: by_zmq(run, curve=False),
}
Found = dict[tuple[str, str], list[Figures]]


async def compare(repeats: int, seconds: float) -> Found:
    found: Found = {(design, link): [] for link in LINKS for design in DESIGNS}
    for _ in range(repeats):
        for design, link in found:
            found[design, link].append(await measure(DESIGNS[design], LINKS[link], seconds))
            print(f"{design}, {link}: {found[design, link][-1]}", file=sys.stderr)
    return found


COLUMNS: dict[str, tuple[str, float, str]] = {
    "age: median ms": ("median_us", 1e-3, ",.2f"),
    "p99 ms": ("p99_us", 1e-3, ",.1f"),
    "frames/s": ("frames_s", 1.0, ".1f"),
    "CPU µs per frame": ("cpu_us", 1.0, ",.0f"),
}


def section(found: Found, link: str) -> str:
    spreads = {
        design: [
            Spread(tuple(getattr(one, f) * unit for one in found[design, link]))
            for f, unit, _ in COLUMNS.values()
        ]
        for design in DESIGNS
    }
    styles = [style for _, _, style in COLUMNS.values()]
    rows = [[design, *map(format, spread, styles)] for design, spread in spreads.items()]
    rows.append(["bridges ÷ ZeroMQ, CURVE", *map(measuring.ratio, spreads[OURS], spreads[CURVE])])
    raw_mb_s = WIDTH * HEIGHT * 3 * RATE_HZ / 1e6
    bytes_s = LINKS[link]
    carries = "more than enough" if math.isinf(bytes_s) else f"{bytes_s / 1e6:g} MB/s"
    title = f"## {link}: {carries}, for {raw_mb_s:.1f} MB/s"
    return f"{title}\n\n{measuring.table(['', *COLUMNS], rows)}\n"


def page(found: Found, repeats: int, seconds: float) -> str:
    sections = "\n".join(section(found, link) for link in LINKS)
    return f"""# Frames between hosts: bridges against ZeroMQ PUB/SUB

`python -m benchmarks.remote_streams` wrote this page. Frames of {WIDTH * HEIGHT * 3:,} bytes at
{RATE_HZ} Hz over TCP on loopback, whole or through a process that lets only so much pass. The age
runs from the frame's stamp, set just before it is sent, to the moment the reader has an `Image` and
has read all its pixels once. CPU is that of all processes that take part, the link's apart: four
with bridges, of which two are on each host, two without. {repeats} repeats in turn of
{seconds:g} s; medians of the repeats (lowest-highest).
ZeroMQ: XPUB and SUB, two parts, high-water mark {HIGH_WATER_MARK}, copy=False, straight between the
two processes that have and want the frames: what it lacks is one copy per host, grants, an end that
is told, and JPEG.

{sections}
Machine: {measuring.machine()}; pyzmq {zmq.__version__}, libzmq {zmq.zmq_version()}.
p99 mostly shows what else the machine was doing; compare medians and ratios.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--read", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.read:
        read(*arguments.read)
        return
    found = asyncio.run(compare(arguments.repeats, arguments.seconds))
    measuring.write("remote_streams", page(found, arguments.repeats, arguments.seconds))


if __name__ == "__main__":
    main()
