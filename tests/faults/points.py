"""Points at which a daemon's life is cut or given an error, and what each came to."""

from __future__ import annotations

import random
import shutil
import subprocess
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.faults.model import Ended, check
from tests.faults.play import Player, codes_of, has_stopped, trace
from tests.faults.ways import COMPONENT_WAYS, newer, sound, way
from tests.kit.evidence import logged
from tests.kit.fork_server import Nursery

from nondum.host.core.records.step import Step
from nondum.host.core.transitions import COMPONENT_TRANSITIONS, TRANSITIONS

ERRORS = ("ENOSPC", "EIO", "EMFILE", "ENOMEM", "EROFS")

FAILING: dict[str, tuple[str, ...]] = {
    "openat": ERRORS,
    "mkdir": ("ENOSPC", "EIO", "EROFS", "ENOMEM"),
    "rename": ("ENOSPC", "EIO", "EROFS"),
    "link": ("ENOSPC", "EIO", "EROFS"),
    "symlink": ("ENOSPC", "EIO", "EROFS"),
    "unlink": ("EIO", "EROFS"),
    "unlinkat": ("EIO", "EROFS"),
    "rmdir": ("EIO", "EROFS"),
    "write": ("ENOSPC", "EIO"),
    "pwrite64": ("ENOSPC", "EIO", "EROFS"),
    "ftruncate": ("EIO", "ENOSPC"),
    "fallocate": ("ENOSPC", "EIO"),
    "fsync": ("EIO", "ENOSPC"),
    "fdatasync": ("EIO", "ENOSPC"),
    "syncfs": ("EIO",),
    "read": ("EIO",),
    "pread64": ("EIO",),
    "getdents64": ("EIO",),
    "fchmod": ("EIO", "EROFS"),
    "utimensat": ("EIO", "EROFS"),
    "mmap": ("ENOMEM",),
    "pipe2": ("EMFILE",),
    "socketpair": ("EMFILE",),
    "dup": ("EMFILE",),
    "fcntl": ("EMFILE",),
    "memfd_create": ("EMFILE", "ENOMEM"),
    "epoll_create1": ("EMFILE",),
    "pidfd_open": ("EMFILE", "ENOMEM"),
    "clone": ("ENOMEM", "EAGAIN"),
    "clone3": ("ENOMEM", "EAGAIN"),
    "vfork": ("ENOMEM", "EAGAIN"),
    "execve": ("ENOMEM", "EIO"),
}
"""System calls that are given errors, and which of them: those that a failing or full disk,
and a process without descriptors or memory, meet."""

KILLING = (
    *("openat", "write", "pwrite64", "fsync", "fdatasync", "syncfs", "rename", "link", "unlink"),
    *("unlinkat", "mkdir", "rmdir", "symlink", "ftruncate", "sendmsg", "recvmsg", "sendto"),
    *("close", "epoll_wait", "vfork", "clone", "clone3", "socketpair", "pipe2", "execve"),
)
"""System calls at which a daemon, or the one of its processes that makes them, is killed."""


@dataclass(frozen=True)
class Result:
    """What one point came to."""

    kind: str
    name: str
    outcome: str
    """`killed`, `lived`, `never`."""
    wrong: tuple[str, ...] = ()
    codes: tuple[str, ...] = ()
    restart_s: float = 0.0


@dataclass(frozen=True)
class Point:
    """One experiment: its kind, and what tells it from others of that kind."""

    kind: str
    name: str
    arguments: dict[str, Any] = field(default_factory=dict, hash=False, compare=False)

    def run(self, nursery: Nursery, folder: Path) -> Result:
        """Do it in a folder, which is there for nothing else and empty."""
        match self.kind:
            case "boundary":
                return _boundary(self, nursery, folder)
            case "moment":
                return _moment(self, nursery, folder)
            case "kill":
                return _call(self, nursery, folder, "signal=SIGKILL")
            case "error":
                return _call(self, nursery, folder, f"error={self.arguments['error']}")
        raise ValueError(self.kind)


def boundaries(times: int) -> Iterator[Point]:
    """Before and after the commit of each row of both tables, `times` times."""
    for nth in range(times):
        for when in ("BEFORE", "AFTER"):
            for of, rows in (("payload", TRANSITIONS), ("component", COMPONENT_TRANSITIONS)):
                for state, event in rows:
                    at = [when, state.name, event.__name__]
                    yield Point("boundary", f"{' '.join((of, *at))} {nth}", {"at": at, "of": of})


def moments(count: int, seed: int = 20) -> Iterator[Point]:
    """Random moments of an installation, an upgrade and two removals."""
    chance = random.Random(seed)
    for nth in range(count):
        late = round(chance.uniform(0.0, 6.0), 3)
        yield Point("moment", f"{nth} at {late} s", {"late_s": late})


def calls(kind: str, counts: dict[str, int], count: int, seed: int = 3) -> Iterator[Point]:
    """`count` of the points that system calls make: the nth of each kind in any thread."""
    chance = random.Random(f"{kind} {seed}")
    every: list[Point] = []
    for call, most in counts.items():
        for nth in range(1, most + 1):
            if kind == "kill" and call in KILLING:
                arguments = {"call": call, "nth": nth}
                every.append(Point("kill", f"{call} {nth}", arguments))
            for error in FAILING.get(call, ()) if kind == "error" else ():
                arguments = {"call": call, "nth": nth, "error": error}
                every.append(Point("error", f"{error} {call} {nth}", arguments))
    # Each call is met as often as any other, rare ones to their last.
    by_call: dict[str, list[Point]] = {}
    for point in chance.sample(every, len(every)):
        by_call.setdefault(point.arguments["call"], []).append(point)
    taken = 0
    while taken < count and by_call:
        for call in list(by_call):
            yield by_call[call].pop()
            taken += 1
            if not by_call[call]:
                del by_call[call]
            if taken == count:
                return


def counted(nursery: Nursery, folder: Path) -> dict[str, int]:
    """How often the busiest thread of a daemon makes each call, from its start to its end."""
    calls = sorted({*FAILING, *KILLING})
    log = folder / "strace"
    _play(nursery, folder, ["-e", f"trace={','.join(calls)}", "-o", str(log)])
    found: Counter[tuple[str, str]] = Counter()
    for line in log.read_text(errors="replace").splitlines():
        pid, _, rest = line.partition(" ")
        call = rest.strip().partition("(")[0]
        if call in calls:
            found[pid, call] += 1
    return {call: max((n for (_, c), n in found.items() if c == call), default=0) for call in calls}


def prepare(folder: Path, drives: dict[str, Any]) -> None:
    """A root for a daemon: drives made, nothing plugged in."""
    (folder / "slots").mkdir(parents=True)
    for slot, write in drives.items():
        write(folder / "drives" / slot)


def _boundary(point: Point, nursery: Nursery, folder: Path) -> Result:
    rows = {(s.name, e.__name__): way(s, e) for s, e in TRANSITIONS}
    if point.arguments["of"] == "component":
        rows = {(s.name, e.__name__): w for (s, e), w in COMPONENT_WAYS.items()}
    when, step, event = point.arguments["at"]
    came = rows[step, event]
    code = nursery.run(came.orders(folder, kill=[when, step, event]))
    ended = check(folder)
    return _result(point, code, ended, came.out_of_place(ended.steps))


def _moment(point: Point, nursery: Nursery, folder: Path) -> Result:
    prepare(folder, {"a": sound, "b": newer})
    script = ("plug a", "plug b", "pull b", "pull a")
    player = Player(folder, script, late_s=point.arguments["late_s"])
    code = nursery.run({"root": str(folder)}, player.play)
    ended = check(folder)
    return _result(point, code, ended, [*_stuck(player), *out_of_place(ended)])


def _call(point: Point, nursery: Nursery, folder: Path, what: str) -> Result:
    call, nth = point.arguments["call"], point.arguments["nth"]
    inject = f"inject={call}:{what}:when={nth}"
    options = ["-e", f"trace={call}", "-e", inject, "-o", "/dev/null"]
    code, player = _play(nursery, folder, options)
    # What fails when all is written down, and nothing runs any more, does no harm.
    fine = code == 0 or has_stopped(folder) or (point.kind == "kill" and code == -9)
    wrong = [] if fine else [f"it ended with {code}; {logged(folder / 'log')}"]
    codes = codes_of(folder)
    if "INTERNAL" in codes:
        wrong.append("an error was not told as what it is")
    ended = check(folder)
    wrong += [*_stuck(player), *out_of_place(ended)]
    return _result(point, code, ended, wrong, codes)


def _play(nursery: Nursery, folder: Path, options: list[str]) -> tuple[int, Player]:
    """A daemon's life under strace: its return code, and who played with it."""
    prepare(folder, {"a": sound})
    tracing: list[subprocess.Popen[bytes]] = []
    player = Player(folder, before=lambda pid: tracing.append(trace(pid, *options)))
    code = nursery.run({"root": str(folder)}, player.play)
    for strace in tracing:
        strace.wait()
    return code, player


def _stuck(player: Player) -> list[str]:
    return [f"stuck at: {player.stuck}"] if player.stuck else []


def _result(
    point: Point, code: int, ended: Ended, wrong: Sequence[str], codes: Sequence[str] = ()
) -> Result:
    outcome = "killed" if code == -9 else "lived"
    names = tuple(sorted({*codes, *ended.codes}))
    every = (*wrong, *ended.wrong)
    return Result(point.kind, point.name, outcome, every, names, ended.restart_s)


def out_of_place(ended: Ended) -> list[str]:
    """What is not where the lamp belongs when nothing is in its way: active, or older than what was
    here before."""
    fine = {Step.ACTIVE, Step.SUPERSEDED}
    is_older = set(ended.codes) <= {"ROLLBACK"} and Step.REFUSED in ended.steps.values()
    wrong = [] if set(ended.steps.values()) <= fine or is_older else [f"came to {ended}"]
    return wrong


def clean(folder: Path) -> None:
    """Leave nothing of an experiment, whatever was mounted."""
    state = folder / "state"  # mostly no mount, which umount would tell for each point
    subprocess.run(["umount", "--lazy", str(state)], check=False, stderr=subprocess.DEVNULL)
    shutil.rmtree(folder, ignore_errors=True)
