"""Two workers that behave: both are called all the time, and one's frames go to the other."""

from __future__ import annotations

import asyncio
import contextlib
import struct
import tempfile
import time
from collections import deque
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pluggy
from benchmarks.misbehaviour.windows import Call, Frame

from nondum.host.core.events.event import Event
from nondum.host.core.events.workers import WorkerExited, WorkerLogged, WorkerStrained
from nondum.host.sandbox.cgroups import Cgroups
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.launcher import WorkerLauncher
from nondum.host.workers.spec import Limits, WorkerSpec, base_interpreter
from nondum.host.workers.workers import Workers
from nondum.sdk.description import Behaviour, Output, PluginDescription, Unit

HOST = "rover"
SDK = Path(__file__).parents[2] / "plugins/sdk"
LIBRARIES = (SDK, Path(pluggy.__file__).parents[1])
LIMITS = Limits(memory_mb=256, tasks=64, descriptors=256, scratch_mb=64, processors=1.0)
PAUSE_S = 0.002
"""Between two calls of a good worker."""
FRAME_S = 0.01
PATIENCE_S = 30.0
FRAMES = "frames"
"""The file of the one that sees frames: number, when made and when seen, 20 bytes each."""
ENTRY = struct.Struct("<Idd")

PLUGIN = """
import asyncio, os, signal, socket, struct, sys, threading, time
from nondum.sdk import Header, Image, Output, Unit, behaviour, hookimpl

def link():
    for name in os.listdir("/proc/self/fd"):
        try:
            found = socket.socket(fileno=os.dup(int(name)))
        except OSError:
            continue
        if found.family == socket.AF_UNIX and found.type == socket.SOCK_SEQPACKET:
            found.setblocking(True)
            return found

@hookimpl
def units():
    return (Unit("it", "sensor", outputs=({outputs})),)

@behaviour("do", action="(do ?u - sensor)")
async def do(ctx, u):
    {body}
"""
SENDS = """
@behaviour("stream", action="(stream ?u - sensor ?o - image)", lasting=True)
async def stream(ctx, u, o):
    output = ctx.output(o)
    await ctx.established()
    number = 0
    while True:
        number += 1
        data = struct.pack("<d", time.monotonic()).ljust(320 * 240, bytes(1))
        output.send(Image(Header(frame_id=u, seq=number), 240, 320, "mono8", 320, data, None))
        await asyncio.sleep(FRAME_S)
""".replace("FRAME_S", str(FRAME_S))
SEES = f"""
@behaviour("watch", action="(watch ?u - sensor ?i - image)", lasting=True)
async def watch(ctx, u, i):
    await ctx.established()
    with open("{FRAMES}", "wb", buffering=0) as file:
        async for image in ctx.input(i):
            seen_s = time.monotonic()
            made_s, = struct.unpack_from("<d", image.data)
            file.write(struct.pack("{ENTRY.format}", image.header.seq, made_s, seen_s))
"""
STREAM = Behaviour("stream", "(stream ?u - sensor ?o - image)", lasting=True)
WATCH = Behaviour("watch", "(watch ?u - sensor ?i - image)", lasting=True)
IMAGES = Output("frames", "image")


@dataclass
class Scene:
    """Good workers that are called, and one that is not good."""

    folder: Path
    cgroups: Cgroups
    confinement: Confinement
    events: deque[tuple[float, Event]] = field(default_factory=deque)
    calls: list[Call] = field(default_factory=list)
    _news: asyncio.Event = field(default_factory=asyncio.Event)

    def __post_init__(self) -> None:
        launcher = WorkerLauncher(self.confinement, self.cgroups)
        self.workers = Workers(HOST, self._on_event, launcher=launcher)

    def _on_event(self, event: Event) -> None:
        self.events.append((time.monotonic(), event))
        self._news.set()

    async def start(
        self,
        name: str,
        body: str,
        more: str = "",
        behaviours: tuple[Behaviour, ...] = (),
        outputs: tuple[Output, ...] = (),
    ) -> None:
        """Start a worker whose behaviour `do` does that, and which has `more` besides."""
        site = self.folder / name / "site-packages"
        site.mkdir(parents=True, exist_ok=True)
        says = "".join(f"Output({one.name!r}, {one.type!r})," for one in outputs)
        source = PLUGIN.replace("{body}", body.replace("\n", "\n    ")).replace("{outputs}", says)
        (site / f"{name}_plugin.py").write_text(source + more, encoding="utf-8")
        spec = WorkerSpec(
            component=name,
            payload="0" * 16,
            distribution=name,
            entry_point=f"{name}_plugin",
            site_packages=(site, *LIBRARIES),
            python=base_interpreter(),
            scratch=self.folder / name / "scratch",
            index=PluginDescription(
                name,
                "0",
                behaviours=(Behaviour("do", "(do ?u - sensor)"), *behaviours),
                units=(Unit("it", "sensor", outputs=outputs),),
            ),
            limits=LIMITS,
        )
        await self.workers.start(spec)

    async def call_for_ever(self, name: str) -> None:
        """Call one of the good ones, again and again."""
        while True:
            begun_s = time.monotonic()
            await self.workers.behave(name, "do", {"u": f"{HOST}__{name}__it"}).ended()
            self.calls.append(Call(begun_s, time.monotonic() - begun_s))
            await asyncio.sleep(PAUSE_S)

    def frames(self) -> list[Frame]:
        """All that were seen."""
        data = (self.folder / "better/scratch" / FRAMES).read_bytes()
        return [Frame(*entry) for entry in ENTRY.iter_unpack(data)]

    async def until_told(self, since_s: float, codes: Sequence[str]) -> tuple[float, str]:
        """Wait until the host says one of these codes of the guest: when, and which."""
        async with asyncio.timeout(PATIENCE_S):
            while True:
                # Each is looked at once: there are more by the second, and this is the loop that
                # the good workers' answers come to.
                while self.events:
                    at_s, event = self.events.popleft()
                    if at_s >= since_s and (code := _code(event, codes)):
                        return at_s, code
                self._news.clear()
                await self._news.wait()


def _code(event: Event, codes: Sequence[str]) -> str:
    match event:
        case WorkerExited("guest", reason):
            return reason.split()[0]
        case WorkerStrained("guest", problems):
            return next((p.code for p in problems if p.code in codes), "")
        case WorkerLogged("guest", _, message) if message.startswith("LOG_DROPPED"):
            return "LOG_DROPPED" if "LOG_DROPPED" in codes else ""
    return ""


@contextlib.asynccontextmanager
async def scene(confinement: Confinement) -> AsyncIterator[Scene]:
    """Two good workers, called all the time, with a stream between them."""
    with tempfile.TemporaryDirectory() as folder:
        cgroups = Cgroups.open(Path(folder))
        made = Scene(Path(folder), cgroups, confinement)
        await made.start("good", "pass", SENDS, (STREAM,), (IMAGES,))
        await made.start("better", "pass", SEES, (WATCH,))
        made.workers.behave(
            "good", "stream", {"u": f"{HOST}__good__it", "o": f"{HOST}__good__frames"}
        )
        made.workers.behave(
            "better", "watch", {"u": f"{HOST}__better__it", "i": f"{HOST}__good__frames"}
        )
        calling = [asyncio.create_task(made.call_for_ever(name)) for name in ("good", "better")]
        try:
            yield made
        finally:
            for task in calling:
                task.cancel()
            await asyncio.gather(*calling, return_exceptions=True)
            await made.workers.close(1.0)
            cgroups.close()
