"""The ways in which a worker misbehaves."""

from __future__ import annotations

import signal
from dataclasses import dataclass


@dataclass(frozen=True)
class Way:
    """One way to misbehave."""

    name: str
    body: str
    codes: tuple[str, ...]
    """The host tells of it with one of these."""
    is_ended: bool = True
    signals: signal.Signals | None = None
    halts: bool = False
    is_long: bool = False
    has_plain: bool = False
    """Whether it does to others what a plain process can do, too."""


def spin(what: str) -> str:
    return f"while True:\n    {what}"


WAYS = (
    Way("exits", "os._exit(3)", ("WORKER_EXITED",)),
    Way("crashes", "os.kill(os.getpid(), signal.SIGSEGV)\ntime.sleep(9)", ("WORKER_EXITED",)),
    Way("blocks its loop", "time.sleep(3600)", ("WORKER_HUNG",), is_long=True),
    Way(
        "is stopped",
        "await asyncio.sleep(3600)",
        ("WORKER_HUNG",),
        signals=signal.SIGSTOP,
        is_long=True,
    ),
    Way(
        "does not halt",
        "while True:\n    try:\n        await asyncio.sleep(9)\n"
        "    except asyncio.CancelledError:\n        pass",
        ("HALT_OVERDUE",),
        halts=True,
        is_long=True,
    ),
    Way(
        "eats memory",
        "import mmap\nheld = []\n"
        + spin("held.append(mmap.mmap(-1, 1 << 20)); held[-1].write(bytes(1 << 20))"),
        ("WORKER_OOM",),
        has_plain=True,
    ),
    Way(
        "forks",
        spin("try:\n        os.fork()\n    except OSError:\n        pass"),
        ("WORKER_TASKS", "WORKER_HUNG"),
        has_plain=True,
    ),
    Way(
        "spins",
        "def spinning():\n    while True:\n        pass\n"
        "threading.Thread(target=spinning, daemon=True).start()",
        ("WORKER_CPU",),
        is_ended=False,
        has_plain=True,
        is_long=True,
    ),
    Way(
        "opens files",
        "held = []\n"
        + spin(
            "try:\n        held.append(os.dup(1))\n    except OSError:\n"
            "        await asyncio.sleep(0.01)"
        ),
        ("WORKER_FDS",),
        has_plain=True,
    ),
    Way(
        "floods its output",
        "end = time.monotonic() + 4\nwhile time.monotonic() < end:\n"
        "    os.write(1, b'y' * 65536); await asyncio.sleep(0)",
        ("LOG_DROPPED",),
        is_ended=False,
        has_plain=True,
    ),
    Way(
        "fills its disk",
        "with open('big', 'wb') as file:\n    while True:\n"
        "        file.write(bytes(1 << 20)); await asyncio.sleep(0)",
        ("SCRATCH_FULL",),
        has_plain=True,
    ),
    Way(
        "sends garbage",
        "link().send(os.urandom(200))\nawait asyncio.sleep(9)",
        ("PROTO_VIOLATION",),
    ),
    Way(
        "floods its link",
        "from nondum.sdk import wire\ns = link()\n"
        "packet = wire.encode(wire.Cancel(1))\n" + spin("s.send(packet)"),
        ("BACKPRESSURE",),
        has_plain=True,
    ),
)
