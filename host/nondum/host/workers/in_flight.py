"""Descriptors that workers have sent over unix sockets and that were not read yet.

The kernel counts them by user, and refuses every process of the user to send more than the limit of
open files of that process (ETOOMANYREFS, unix(7)): a worker that sends and does not read holds up
all others of its user. proc(5) tells for each socket how many wait in it (`scm_fds`, Linux 5.6).
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path

from nondum.host.workers import problems
from nondum.host.workers.leftovers import marked
from nondum.host.workers.worker import Worker

EXPLAINED = 3
"""Of a worker that works: what is under way to each of its streams' ends."""
FEW = 64
"""Descriptors that hold up nothing, beyond what its streams explain."""
MOST_IN_ONE = 253
"""Descriptors in one packet (SCM_MAX_FD)."""
PAUSE_S = 0.2
"""After a search, before the next one."""
TELL_S = 10.0
"""Before the same is logged again."""
log = logging.getLogger(__name__)

_WAITING = re.compile(r"^scm_fds:\s*(\d+)$", re.MULTILINE)


def sent(
    pids: Collection[int], own: str, senders: Mapping[int, str], *, is_whole: bool
) -> Counter[str]:
    """Component → descriptors that it has sent and that wait with these processes of `own`.

    `senders` tells of sockets that others send to; all else it has sent to itself. Where these are
    all its processes (`is_whole`), and it has a network namespace, sockets of that namespace that
    none of them has open are under way themselves: what waits in them cannot be counted, and is
    taken for a packet full. Blocks.
    """
    counted: Counter[str] = Counter()
    sockets = dict(found for pid in pids for found in _sockets(pid))
    for inode, count in sockets.items():
        counted[senders.get(inode, own)] += count
    if is_whole:
        hidden = max((_nowhere_open(pid, sockets) for pid in pids), default=0)
        counted[own] += MOST_IN_ONE * hidden
    return counted


def culprit(sent_by: Mapping[str, int], ends: Mapping[str, int]) -> str | None:
    """The component that has most under way beyond what its streams explain; None: none has many.

    `ends` tells how many ends of streams a component has.

    >>> culprit({"camera": 6, "hostile": 1250}, {"camera": 2})
    'hostile'
    >>> culprit({"camera": 9, "eye": 2}, {"camera": 1})
    """
    beyond = {name: count - EXPLAINED * ends.get(name, 0) for name, count in sent_by.items()}
    worst = max(sorted(beyond), key=beyond.__getitem__, default=None)
    return worst if worst is not None and beyond[worst] > FEW else None


def _sockets(pid: int) -> Iterator[tuple[int, int]]:
    """Inode of each unix socket that a process has open → descriptors that wait in it."""
    with contextlib.suppress(OSError):  # it has ended, or may not be looked at
        for entry in Path(f"/proc/{pid}/fdinfo").iterdir():
            with contextlib.suppress(OSError):  # it has just been closed
                waiting = _WAITING.search(entry.read_text(encoding="ascii"))
                if waiting:
                    yield Path(f"/proc/{pid}/fd/{entry.name}").stat().st_ino, int(waiting[1])


def _nowhere_open(pid: int, known: Collection[int]) -> int:
    """How many unix sockets in its separate network namespace no process of a worker has open."""
    try:
        if Path(f"/proc/{pid}/ns/net").stat().st_ino == Path("/proc/self/ns/net").stat().st_ino:
            return 0
        lines = Path(f"/proc/{pid}/net/unix").read_text(encoding="utf-8").splitlines()[1:]
    except OSError:
        return 0
    inodes = (line.split()[6] for line in lines)
    return sum(1 for inode in inodes if int(inode) not in known)


class Search:
    """Finds the worker that holds others up, and ends it. Make and use it on the loop."""

    def __init__(
        self, senders: Callable[[], Mapping[int, str]], ends: Callable[[], Mapping[str, int]]
    ) -> None:
        """`senders` and `ends` tell of the streams that are wired now (`sent`, `culprit`)."""
        self._senders, self._ends = senders, ends
        self._workers: set[Worker] = set()
        self._running: asyncio.Task[None] | None = None
        self.refusals = 0
        """How often descriptors could not be sent at once, as far as that was told."""
        self._told, self._told_s = "", 0.0

    def watch(self, worker: Worker) -> None:
        """Look at a worker, too, until it is gone."""
        self._workers.add(worker)
        worker.gone.add_done_callback(lambda _: self._workers.discard(worker))

    def begin(self, count: int = 1) -> None:
        """Descriptors could not be sent, `count` times: look which worker keeps them under way,
        unless that is being done, or was just done."""
        self.refusals += count
        if self._running is None or self._running.done():
            self._running = asyncio.create_task(self._run())

    async def close(self) -> None:
        """Look no more."""
        if self._running is not None:
            self._running.cancel()
            await asyncio.wait([self._running])

    async def _run(self) -> None:
        workers = tuple(self._workers)
        senders = dict(self._senders())
        counted = await asyncio.to_thread(_counted, workers, senders)
        name = culprit(counted, self._ends())
        self._tell(f"{name} keeps {counted[name]} under way" if name else "no worker explains that")
        for worker in workers:
            if worker.spec.component == name:
                worker.end(problems.in_flight(name, counted[name]))
        await asyncio.sleep(PAUSE_S)

    def _tell(self, why: str) -> None:
        """Say why, and the same again only after a while."""
        now_s = asyncio.get_running_loop().time()
        if why != self._told or now_s >= self._told_s + TELL_S:
            self._told, self._told_s = why, now_s
            log.warning("descriptors cannot be sent for now: %s", why)


def _counted(workers: Collection[Worker], senders: Mapping[int, str]) -> Counter[str]:
    counted: Counter[str] = Counter()
    for worker in workers:
        pids = set(worker.pids())
        if (
            not worker.is_in_cgroup
        ):  # what it has started is found as far as it kept its environment
            pids.update(marked(worker.spec.scratch))
        counted += sent(pids, worker.spec.component, senders, is_whole=worker.is_in_cgroup)
    return counted
