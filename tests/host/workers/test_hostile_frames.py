"""Workers that speak the link's language badly or too well, each a process with the bare socket:
each ends itself only, with a code of the protocol, and the host keeps nothing of it."""

from __future__ import annotations

import asyncio
import gc
import os
import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.guest import do, guest_spec
from tests.kit.until import arrived
from tests.kit.workers import HOST, TIMING, WorkersUnderTest

from nondum.host.core.events.event import Event
from nondum.host.core.events.workers import WorkerLogged, WorkerReady
from nondum.host.workers.process import WorkerProcess
from nondum.host.workers.spec import WorkerSpec
from nondum.host.workers.workers import Workers
from nondum.planning.execute.running import RunState
from nondum.sdk.errors import WorkerFailed
from nondum.sdk.wire import PROTOCOL_VERSIONS
from nondum.wheelhouse.format.confinement import Level

pytestmark = pytest.mark.anyio

SDK = Path(__file__).parents[3] / "plugins/sdk"
PROLOGUE = f"""
import os, socket, sys, time
sys.path[:0] = {[str(SDK), *(p for p in sys.path if p.endswith("site-packages"))]!r}
import msgpack
link = socket.socket(fileno=int(sys.argv[1]))
def send(*fields, fds=()):
    socket.send_fds(link, [msgpack.packb(list(fields))], list(fds))
def hear():
    return msgpack.unpackb(link.recv(1 << 17))
def greet():
    send(0, {list(PROTOCOL_VERSIONS)!r}, '0.1', os.getpid()); hear()
HELLO, WELCOME, REQUEST, REPLY, FAILURE, EVENT, CANCEL = range(7)
"""
EVERY = "while True: send(EVENT, 'log', None, {'level': 'info', 'message': "


class RawLauncher:
    """Launches what was never a plugin."""

    level = Level.NONE

    def __init__(self, script: str) -> None:
        self._script = script

    async def launch(self, spec: WorkerSpec, sock: socket.socket) -> WorkerProcess:
        spec.scratch.mkdir(parents=True, exist_ok=True)
        arguments = [sys.executable, "-I", "-S", "-c", PROLOGUE + self._script, str(sock.fileno())]
        popen = subprocess.Popen(  # noqa: ASYNC220
            arguments,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,
            pass_fds=(sock.fileno(),),
            start_new_session=True,
        )
        return WorkerProcess(popen)

    async def warm(self) -> None:
        """Nothing is prepared."""

    async def close(self) -> None:
        """Nothing was prepared."""


HOSTILE: Mapping[str, tuple[str, str]] = {
    "garbage first": ("link.send(os.urandom(100))", "PROTO_VIOLATION"),
    "empty table": ("link.send(b'\\x80')", "PROTO_VIOLATION"),
    "unknown kind": ("send(99, 1, 2)", "PROTO_VIOLATION"),
    "too few fields": ("send(HELLO)", "PROTO_VIOLATION"),
    "welcome instead of hello": ("send(WELCOME, 1, {})", "PROTO_VIOLATION"),
    "version of the future": ("send(HELLO, [99], '9.9', 1)", "PROTO_VERSION"),
    "hello twice": ("greet(); send(HELLO, [1], 'x', 1)", "PROTO_VIOLATION"),
    "deep": (
        "greet()\nlink.send(b'\\x94\\x05\\xa1x\\xc0' + b'\\x81\\xa1a' * 900 + b'\\xc0')",
        "PROTO_VIOLATION",
    ),
    "long": (
        "link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 20)\n"
        "link.send(b'\\x00' * 100_000)",
        "PROTO_VIOLATION",
    ),
    "lying lengths": (
        "greet(); link.send(b'\\x94\\x05\\xdd\\xff\\xff\\xff\\xff')",
        "PROTO_VIOLATION",
    ),
    "nan": (
        "greet(); send(EVENT, 'progress', 1, {'fraction': float('nan'), 'text': ''})",
        "PROTO_VIOLATION",
    ),
    "same key twice": (
        "greet(); link.send(b'\\x94\\x05\\xa1x\\xc0\\x82\\xa1a\\x01\\xa1a\\x02')",
        "PROTO_VIOLATION",
    ),
    "extension": (
        "greet(); link.send(b'\\x94\\x05\\xa1x\\xc0\\x81\\xa1a\\xd4\\x01\\x00')",
        "PROTO_VIOLATION",
    ),
    "unexpected answer": ("greet(); send(REPLY, 4711, {})", "PROTO_VIOLATION"),
    "request": ("greet(); send(REQUEST, 1, 'mount', {'node': '/dev/sda'})", "PROTO_VIOLATION"),
    "unasked descriptor": (
        "greet(); send(EVENT, 'heartbeat', None, {}, fds=[0])",
        "PROTO_VIOLATION",
    ),
    "two hundred descriptors": ("send(HELLO, [1], 'x', 1, fds=[0] * 200)", "PROTO_VIOLATION"),
    "unknown event": ("greet(); send(EVENT, 'boast', None, {})", "PROTO_VIOLATION"),
    "half closed": ("link.shutdown(socket.SHUT_WR)", "WORKER_HUNG"),
    "says nothing": ("", "WORKER_HUNG"),
    "never reads": ("send(HELLO, [1], 'x', 1)", "WORKER_HUNG"),
    "flood of heartbeats": (
        "greet()\nwhile True: send(EVENT, 'heartbeat', None, {})",
        "BACKPRESSURE",
    ),
    "flood of logs": (f"greet()\n{EVERY}'x' * 60_000}})", "BACKPRESSURE"),
    "flood of cancellations": ("greet()\nwhile True: send(CANCEL, 1)", "BACKPRESSURE"),
    "flood of descriptors": (
        "while True: send(HELLO, [1], 'x', 1, fds=[0, 0, 0, 0])",
        "PROTO_VIOLATION",
    ),
    "facts without end": (
        "greet()\nn = 0\nwhile True:\n    n += 1\n    send(EVENT, 'know', None, "
        "{'predicate': 'p', 'arguments': [f'{n:0250}'] * 100})",
        "PROTO_VIOLATION",
    ),
}


@pytest.fixture
async def other(tmp_path: Path, clock: VirtualClock) -> AsyncIterator[WorkersUnderTest]:
    """A good worker, which answers before and after."""
    # Its signs of life are real, and whole start-up times pass here.
    tested = WorkersUnderTest(tmp_path, replace(TIMING, missed=1_000_000))
    await tested.workers.start(guest_spec(tested, "pass", name="good"))
    yield tested
    assert await do(tested, "good").ended() is RunState.SUCCEEDED
    assert len(tested.told(WorkerReady)) == 1
    await tested.close(clock)


async def meet(tested: WorkersUnderTest, name: str, script: str, *, hangs: bool = False) -> str:
    """Start a hostile worker, which fails; give the code. One that `hangs` does so when it has
    said all that it has to say, and the time for a start is over."""
    has_said, clock = asyncio.Event(), asyncio.get_running_loop()
    assert isinstance(clock, VirtualClock)

    def on_event(event: Event) -> None:
        if isinstance(event, WorkerLogged) and event.message == "said all":
            has_said.set()

    launcher = RawLauncher(f"{script}\nprint('said all', flush=True)\ntime.sleep(60)")
    workers = Workers(HOST, on_event, launcher=launcher, timing=TIMING)
    starting = asyncio.create_task(workers.start(tested.spec(name, "")))
    try:
        if hangs:
            await arrived(f"all that {name} says", has_said.wait())
            await clock.advance(TIMING.startup_s)
        with pytest.raises(WorkerFailed) as failed:
            await arrived(f"failure of {name}", starting)
    finally:
        await workers.close()
    return failed.value.code


@pytest.mark.parametrize("name", list(HOSTILE))
async def test_it_ends_itself_only(other: WorkersUnderTest, name: str) -> None:
    script, code = HOSTILE[name]
    assert await meet(other, "bad", script, hangs=code == "WORKER_HUNG") == code


async def test_the_host_keeps_nothing_of_them(other: WorkersUnderTest) -> None:
    """Descriptors and memory after many rounds are what they were after one."""
    quick = [script for script, code in HOSTILE.values() if code == "PROTO_VIOLATION"]
    await asyncio.gather(*(meet(other, f"warm-{n}", script) for n, script in enumerate(quick)))
    descriptors, memory = held()
    for turn in range(3):
        await asyncio.gather(
            *(meet(other, f"bad-{turn}-{n}", script) for n, script in enumerate(quick))
        )
    after_descriptors, after_memory = held()
    assert after_descriptors == descriptors
    assert after_memory - memory < 8 << 20


def held() -> tuple[int, int]:
    """Open descriptors, and resident bytes, of this process."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return len(os.listdir("/proc/self/fd")), pages * os.sysconf("SC_PAGE_SIZE")  # noqa: PTH208
