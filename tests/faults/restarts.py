"""Daemons that are killed at random moments and started again at once, on a machine under load.

    python -m tests.faults.restarts --times 500

Each time, a daemon is killed at a random moment of its life, perhaps before it has come up. The
next one is started as soon as the dead one is reaped; it must come up: recover, and commit that.
Then it is killed at a random moment, too. Busy loops beside the daemons are the load.

A time is wrong if a daemon ends by itself or does not come up. Its folder with the daemons' log is
kept, and the exit status is 1. A run with the same seed goes on where the one before it stopped.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import math
import os
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Collection, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path

from demo.robot import TooLate
from tests.campaign.progress import Limit, Progress
from tests.faults.play import is_dead
from tests.faults.ways import Way
from tests.kit.evidence import logged
from tests.kit.fork_server import Nursery
from tests.kit.until import until

FOLDER = Path("build/restarts")
LONGEST_LIFE_S = 1.5
"""Of the first daemon from its birth, of the next one from when it has come up."""
TIMES = 2
"""On one state folder: a payload that is there when more daemons die is quarantined, and nothing is
started for it any more."""
REPORT = 50
KILLED = -signal.SIGKILL
BUSY = "import os\nparent = os.getppid()\nwhile os.getppid() == parent: pass"


def main() -> int:
    """Go on until all is done or the time is over; 1 if anything was wrong."""
    options = _options()
    say(f"seed {options.seed}")
    folder, limit = options.folder.resolve(), Limit(options.minutes)
    names = [f"{options.seed}-{number}" for number in range(math.ceil(options.times / TIMES))]
    score = Score.of(names, Progress.read(folder))
    left = iter([name for name in names if name not in score.done])
    with _load(options.busy), ThreadPoolExecutor(options.jobs) as pool:
        running: set[Future[Result]] = set()
        while True:
            free = 0 if limit.is_over else options.jobs - len(running)
            running |= {pool.submit(_try, folder, name) for name in itertools.islice(left, free)}
            if not running:
                break
            ended, running = wait(running, return_when=FIRST_COMPLETED)
            for result in (future.result() for future in ended):
                score.add(result)
            Progress(len(names), tuple(score.done), tuple(score.wrong)).write(folder)
    right = (len(score.done) - len(score.wrong)) * TIMES
    say(f"{right} of {len(score.done) * TIMES}, {len(score.wrong)} wrong")
    return bool(score.wrong)


@dataclass(frozen=True)
class Result:
    """What became of one state folder."""

    name: str
    wrong: str = ""
    """What went wrong, with the log."""
    folder: Path | None = None
    """Of what is kept of it."""


@dataclass
class Score:
    """The state folders that were done, in this run and those before it."""

    done: list[str]
    wrong: list[str]

    @classmethod
    def of(cls, names: Collection[str], former: Progress | None) -> Score:
        """What is known of these names."""
        done, failed = (former.done, former.failed) if former else ((), ())
        return cls([n for n in done if n in names], [n for n in failed if n in names])

    def add(self, result: Result) -> None:
        """Count it, and tell how it stands now and then."""
        self.done.append(result.name)
        if result.wrong:
            self.wrong.append(result.name)
            say(f"WRONG (evidence: {result.folder}) {result.wrong}")
        if len(self.done) % (REPORT // TIMES) == 0:
            say(f"{len(self.done) * TIMES}: {len(self.wrong)} wrong")


def _try(folder: Path, name: str) -> Result:
    """`TIMES` times on a state folder, which is kept if one of them is wrong."""
    root = folder / name
    shutil.rmtree(root, ignore_errors=True)  # a run before this one was interrupted
    root.mkdir(parents=True)
    chance = random.Random(name)
    orders = Way().orders(root)
    try:
        for _ in range(TIMES):
            server = _server()
            server.run(orders, late_s=chance.uniform(0.0, LONGEST_LIFE_S), expect=KILLED)
            orders["script"] = ()
            life = Life(root, chance.uniform(0.0, LONGEST_LIFE_S))
            server.run(orders, life.live, expect=KILLED)
    except (AssertionError, TimeoutError, TooLate) as error:
        _end_server()
        (root / "wrong").write_text(str(error), encoding="utf-8")
        return Result(name, str(error), root)
    shutil.rmtree(root, ignore_errors=True)
    return Result(name)


@dataclass(frozen=True)
class Life:
    """Of a daemon that must come up."""

    root: Path
    life_s: float
    """Between its coming up and its death."""

    def live(self, pid: int) -> None:
        """Kill the daemon some time after it has come up. Raises `TooLate` if it does not."""
        try:
            until(
                "the daemon comes up",
                lambda: self._is_up(pid) or is_dead(pid),
                evidence=lambda: logged(self.root / "log"),
            )
            threading.Event().wait(self.life_s)  # a random moment is what is wanted
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def _is_up(self, pid: int) -> bool:
        with contextlib.suppress(FileNotFoundError):
            return f"committed {pid}-" in (self.root / "told").read_text(encoding="utf-8")
        return False


_of_thread = threading.local()


def _server() -> Nursery:
    if getattr(_of_thread, "server", None) is None:
        _of_thread.server = Nursery().__enter__()
    server: Nursery = _of_thread.server
    return server


def _end_server() -> None:
    _of_thread.server.__exit__(None, None, None)
    _of_thread.server = None


@contextlib.contextmanager
def _load(busy: int) -> Iterator[None]:
    loops = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(busy)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


def say(line: str) -> None:
    print(line, flush=True)  # noqa: T201  # a program for people


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.faults.restarts", description=__doc__)
    parser.add_argument("--times", type=int, default=500, help="kills with a restart in all")
    parser.add_argument("--minutes", type=float, help="how long to go on; without: until done")
    parser.add_argument("--jobs", type=int, default=4, help="state folders at the same time")
    parser.add_argument("--busy", type=int, default=2, help="busy loops beside the daemons")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="what was done, and evidence")
    parser.add_argument("--seed", type=int, default=time.time_ns() // 1_000_000)
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
