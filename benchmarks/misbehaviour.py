"""Workers that misbehave, in thirteen ways, beside some that do not: `python
benchmarks/misbehaviour.py [--times 50]`. Needs root (cgroups). Writes docs/reliability/workers.md.

Two good workers are called in turn all the time. Their slowest calls while a third worker
misbehaves are held against those of a time before, when it only stood by.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import math
import os
import signal
import tempfile
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pluggy
from measuring import Spread, machine, percentile, table

from nondum.host import heap
from nondum.host.cgroups import Cages
from nondum.host.events import Event, WorkerExited, WorkerLogged, WorkerStrained
from nondum.host.workers.confinements import Boxed, Confinement, Held, Unconfined
from nondum.host.workers.launcher import WorkerLauncher
from nondum.host.workers.spec import Limits, WorkerSpec, base_interpreter
from nondum.host.workers.worker import Worker
from nondum.host.workers.workers import Workers
from nondum.sdk.description import Behaviour, PluginDescription, Unit
from nondum.sdk.errors import Problem

HOST = "rover"
SDK = Path(__file__).parents[1] / "plugins/sdk"
PAGE = Path(__file__).parents[1] / "docs/reliability/workers.md"
LIMITS = Limits(memory_mb=256, tasks=64, descriptors=256, scratch_mb=64, processors=1.0)
BASELINE_S = 3.0
PAUSE_S = 0.002
"""Between two calls of a good worker."""
PATIENCE_S = 30.0

PLUGIN = """
import asyncio, os, signal, socket, sys, threading, time
from nondum.sdk import Unit, behaviour, hookimpl

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
    return (Unit("it", "sensor"),)

@behaviour("do", action="(do ?u - sensor)")
async def do(ctx, u):
    {body}
"""


@dataclass(frozen=True)
class Way:
    """One way to misbehave."""

    name: str
    body: str
    codes: tuple[str, ...]
    """What it is told with."""
    is_ended: bool = True
    signals: signal.Signals | None = None
    halts: bool = False


def spin(what: str) -> str:
    return f"while True:\n    {what}"


WAYS = (
    Way("exits", "os._exit(3)", ("WORKER_EXITED",)),
    Way("crashes", "os.kill(os.getpid(), signal.SIGSEGV)\ntime.sleep(9)", ("WORKER_EXITED",)),
    Way("blocks its loop", "time.sleep(3600)", ("WORKER_HUNG",)),
    Way("is stopped", "await asyncio.sleep(3600)", ("WORKER_HUNG",), signals=signal.SIGSTOP),
    Way(
        "does not halt",
        "while True:\n    try:\n        await asyncio.sleep(9)\n"
        "    except asyncio.CancelledError:\n        pass",
        ("HALT_OVERDUE",),
        halts=True,
    ),
    Way("eats memory", "import mmap\nheld = []\n" + spin(
        "held.append(mmap.mmap(-1, 1 << 20)); held[-1].write(bytes(1 << 20))"), ("WORKER_OOM",)),
    Way("forks", spin("try:\n        os.fork()\n    except OSError:\n        pass"),
        ("WORKER_TASKS", "WORKER_HUNG")),
    Way("spins", "def spinning():\n    while True:\n        pass\n"
        "threading.Thread(target=spinning, daemon=True).start()",
        ("WORKER_CPU",), is_ended=False),
    Way("opens files", "held = []\n" + spin(
        "try:\n        held.append(os.dup(1))\n    except OSError:\n"
        "        await asyncio.sleep(0.01)"),
        ("WORKER_FDS",)),
    Way("floods its output", "end = time.monotonic() + 4\nwhile time.monotonic() < end:\n"
        "    os.write(1, b'y' * 65536); await asyncio.sleep(0)", ("LOG_DROPPED",), is_ended=False),
    Way("fills its disk", "with open('big', 'wb') as file:\n    while True:\n"
        "        file.write(bytes(1 << 20)); await asyncio.sleep(0)", ("SCRATCH_FULL",)),
    Way("sends garbage", "link().send(os.urandom(200))\nawait asyncio.sleep(9)",
        ("PROTO_VIOLATION",)),
    Way("floods its link", "from nondum.sdk import wire\ns = link()\n"
        "packet = wire.encode(wire.Cancel(1))\n" + spin("s.send(packet)"), ("BACKPRESSURE",)),
)  # fmt: skip


@dataclass
class Round:
    """What one misbehaviour led to."""

    told_s: float
    """From its beginning until it was told or acted upon."""
    gone_s: float
    """From there until nothing of the worker was left; 0 where it goes on."""
    code: str
    base_ms: float
    """99th percentile of the good workers' calls before."""
    slow_ms: float
    """The same, while it lasted."""


@dataclass
class Scene:
    """Good workers that are called, and one that is not good."""

    folder: Path
    cages: Cages
    confinement: Confinement
    decided_s: float = 0.0
    events: deque[tuple[float, Event]] = field(default_factory=deque)
    took_ms: list[float] = field(default_factory=list)
    _news: asyncio.Event = field(default_factory=asyncio.Event)

    def __post_init__(self) -> None:
        launcher = WorkerLauncher(self.confinement, self.cages)
        self.workers = Workers(HOST, self._on_event, launcher=launcher)

    def _on_event(self, event: Event) -> None:
        self.events.append((time.monotonic(), event))
        self._news.set()

    def spec(self, name: str, body: str) -> WorkerSpec:
        site = self.folder / name / "site-packages"
        site.mkdir(parents=True, exist_ok=True)
        source = PLUGIN.replace("{body}", body.replace("\n", "\n    "))
        (site / f"{name}_plugin.py").write_text(source, encoding="utf-8")
        behaviours = (Behaviour("do", "(do ?u - sensor)"),)
        index = PluginDescription(name, "0", behaviours=behaviours, units=(Unit("it", "sensor"),))
        return WorkerSpec(
            component=name,
            payload="0" * 16,
            distribution=name,
            entry_point=f"{name}_plugin",
            site_packages=(site, SDK, Path(pluggy.__file__).parents[1]),
            python=base_interpreter(),
            scratch=self.folder / name / "scratch",
            index=index,
            limits=LIMITS,
        )

    async def call_for_ever(self, name: str) -> None:
        while True:
            begun_s = time.perf_counter()
            await self.workers.behave(name, "do", {"u": f"{HOST}__{name}__it"}).ended()
            self.took_ms.append((time.perf_counter() - begun_s) * 1e3)
            await asyncio.sleep(PAUSE_S)

    async def until_told(self, since_s: float, codes: Sequence[str]) -> tuple[float, str]:
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
    """Two good workers, called all the time."""
    with tempfile.TemporaryDirectory() as folder:
        cages = Cages.open(Path(folder))
        made = Scene(Path(folder), cages, confinement)
        calling = []
        for name in ("good", "better"):
            await made.workers.start(made.spec(name, "pass"))
            calling.append(asyncio.create_task(made.call_for_ever(name)))
        try:
            yield made
        finally:
            for task in calling:
                task.cancel()
            await asyncio.gather(*calling, return_exceptions=True)
            await made.workers.close(1.0)
            cages.close()


async def misbehave(made: Scene, way: Way, decided: list[float]) -> Round:
    """Have it happen once."""
    await made.workers.start(made.spec("guest", way.body))
    await asyncio.sleep(0.5)
    made.took_ms.clear()
    await asyncio.sleep(BASELINE_S)
    before = list(made.took_ms)
    made.took_ms.clear()
    made.events.clear()
    decided.clear()
    begun_s = time.monotonic()
    call = made.workers.behave("guest", "do", {"u": f"{HOST}__guest__it"})
    if way.signals is not None:
        os.kill(made.workers.pids()["guest"], way.signals)
    if way.halts:
        await asyncio.sleep(0.1)
        call.halt()
    at_s, code = await made.until_told(begun_s, way.codes)
    told_s = decided[0] if decided and way.is_ended else at_s
    during = list(made.took_ms)
    await made.workers.stop("guest", 0.5)
    return Round(
        told_s=told_s - begun_s,
        gone_s=at_s - told_s if way.is_ended else 0.0,
        code=code,
        base_ms=percentile(before, 99),
        slow_ms=percentile(during, 99) if len(during) > 20 else float("nan"),
    )


def watched(decided: list[float]) -> Callable[[Worker, Problem, float], None]:
    """`Worker.end`, with the time at which it was decided."""
    end = Worker.end

    def deciding(self: Worker, problem: Problem, term_s: float = 0.0) -> None:
        if self.spec.component == "guest":
            decided.append(time.monotonic())
        end(self, problem, term_s)

    return deciding


async def main(times: int, confinement: Confinement) -> str:
    heap.keep_what_is_loaded()  # as a daemon does
    decided: list[float] = []
    Worker.end = watched(decided)  # type: ignore[method-assign]  # of this process only
    rows = []
    async with scene(confinement) as made:
        pids = made.workers.pids()
        for way in WAYS:
            rounds = [await misbehave(made, way, decided) for _ in range(times)]
            rows.append(_row(way, rounds))
            print(" | ".join(rows[-1]), flush=True)
        assert made.workers.pids() == pids, "the good ones are those of the beginning"
    head = ["it …", "code", "told after s", "gone after another s", "others' p99 ms before",
            "others' p99 ms meanwhile", "times"]  # fmt: skip
    return table(head, rows)


def _row(way: Way, rounds: Sequence[Round]) -> list[str]:
    slow = [r for r in rounds if not math.isnan(r.slow_ms)]
    return [
        way.name,
        ", ".join(sorted({f"`{r.code}`" for r in rounds})),
        f"{Spread(tuple(r.told_s for r in rounds)):.2f}",
        f"{Spread(tuple(r.gone_s for r in rounds)):.2f}" if way.is_ended else "goes on",
        f"{Spread(tuple(r.base_ms for r in rounds)):.1f}",
        f"{Spread(tuple(r.slow_ms for r in slow)):.1f}" if slow else "too short",
        f"{Spread(tuple(r.slow_ms / r.base_ms for r in slow)):.1f}" if slow else "",
    ]


CONFINEMENTS: dict[str, Callable[[], Confinement]] = {
    "sandboxed": lambda: Boxed("bwrap"),
    "restricted": Held,
    "none": Unconfined,
}
PAGE_TEXT = """# Workers that misbehave

Written by `python benchmarks/misbehaviour.py`. Two good workers are called in turn, every 2 ms,
while a third one misbehaves: each way {times} times, at confinement level `{level}`, with
{memory_mb} MB of memory, {tasks} tasks, {descriptors} descriptors, {scratch_mb} MB of scratch and
one processor. *Told* is when the host acts on it or says so, *gone* when nothing of the worker is
left; medians (lowest-highest). The good workers are the same processes from the first row to the
last, and so is the daemon.

{table}

Machine: {machine}.
A way that is ended after some tenths of a second leaves some 200 calls: their 99th percentile is
one of the two or three slowest.

A worker that hangs is found by its heartbeat, which it sends every 2 s and of which it may miss
three. What it uses is looked at every 2 s, and as soon as 64 MB of disk have gone. It is started
again after 1, 2 and 4 s, and not a fourth time within a minute.
"""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--level", choices=CONFINEMENTS, default="sandboxed")
    told = parser.parse_args()
    found = asyncio.run(main(told.times, CONFINEMENTS[told.level]()))
    limits = {name: getattr(LIMITS, name) for name in ("memory_mb", "tasks", "descriptors")}
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(
        PAGE_TEXT.format(
            times=told.times,
            level=told.level,
            table=found,
            machine=machine(),
            scratch_mb=LIMITS.scratch_mb,
            **limits,
        ),
        encoding="utf-8",
    )
