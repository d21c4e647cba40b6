"""Progress of a campaign: the pieces done, those that failed, and the time left.

A round is one time through all pieces. It is kept in a folder, so that a run goes on where the one
before it stopped.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

FILE = "round.json"


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a round is."""

    of: int
    """Pieces that it has."""
    done: tuple[str, ...] = ()
    """Failed ones, too."""
    failed: tuple[str, ...] = ()

    @property
    def is_whole(self) -> bool:
        return len(self.done) >= self.of

    def __str__(self) -> str:
        return f"{len(self.done)} of {self.of}"

    def write(self, folder: Path) -> None:
        """Keep it: the former one stays until this one is there."""
        folder.mkdir(parents=True, exist_ok=True)
        new = folder / f"{FILE}.new"
        new.write_text(json.dumps(asdict(self)), encoding="utf-8")
        new.replace(folder / FILE)

    @classmethod
    def read(cls, folder: Path) -> Progress | None:
        """That of a folder; None if nothing was begun there."""
        file = folder / FILE
        if not file.exists():
            return None
        told = json.loads(file.read_text(encoding="utf-8"))
        return cls(told["of"], tuple(told["done"]), tuple(told["failed"]))


class Limit:
    """The time that a run has."""

    def __init__(self, minutes: float | None, clock: Callable[[], float] = time.monotonic) -> None:
        """None: as long as it takes."""
        self._clock, self._begun_s = clock, clock()
        self._seconds = None if minutes is None else minutes * 60

    @property
    def elapsed_s(self) -> float:
        return self._clock() - self._begun_s

    @property
    def left_s(self) -> float | None:
        """None: there is no limit."""
        return None if self._seconds is None else max(0.0, self._seconds - self.elapsed_s)

    @property
    def is_over(self) -> bool:
        return self.left_s == 0.0

    def __str__(self) -> str:
        left = "" if self.left_s is None else f", {minutes_of(self.left_s)} left"
        return f"[{minutes_of(self.elapsed_s)}{left}]"


def minutes_of(seconds: float) -> str:
    """Minutes and seconds.

    >>> minutes_of(3723.4)
    '62:03'
    """
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"


class Round:
    """The pieces of one round, worked off one after the other, or some at the same time."""

    def __init__(
        self,
        folder: Path,
        pieces: Sequence[str],
        limit: Limit,
        say: Callable[[str], None] | None = None,
    ) -> None:
        self.folder, self.limit = folder, limit
        self.pieces, self._say = pieces, say or _print
        self._lock = threading.Lock()
        before = Progress.read(folder) or Progress(0)
        self.progress = Progress(
            len(pieces), _among(before.done, pieces), _among(before.failed, pieces)
        )
        self.progress.write(folder)

    def due(self) -> Iterator[str]:
        """The pieces that were not done yet, until the time is over."""
        for piece in self.pieces:
            if self.limit.is_over:
                return
            if piece not in self.progress.done:
                yield piece

    def add(self, piece: str, *, passed: bool, note: str = "") -> None:
        """A piece is done: keep that, and say so."""
        with self._lock:
            others = [one for one in self.progress.done if one != piece]
            failed = [one for one in self.progress.failed if one != piece]
            if not passed:
                failed.append(piece)
            self.progress = Progress(len(self.pieces), (*others, piece), tuple(failed))
            self.progress.write(self.folder)
            mark = "passed" if passed else "FAILED"
            more = f"  {note}" if note else ""
            self._say(f"{self.limit} {self.progress}  {mark}  {piece}{more}")

    def end(self) -> int:
        """Say how far it is; the exit status: 1 if anything has failed."""
        for piece in self.progress.failed:
            self._say(f"FAILED {piece}")
        self._say(f"{self.progress} done, {len(self.progress.failed)} failed")
        return 1 if self.progress.failed else 0


def work_off(
    pieces: Iterator[str],
    at_once: int,
    do: Callable[[int, str], None],
    on_interrupt: Callable[[], None] = lambda: None,
) -> None:
    """Call `do` with the number of a worker thread (from 0) and a piece, for each piece, in
    `at_once` threads; in this thread if that is 1.

    After an exception (Ctrl-C, too) no further piece is begun. Pieces that have begun are waited
    for; with several threads, `on_interrupt` is called before, and may end them.
    """
    taking, ending = threading.Lock(), threading.Event()

    def next_piece() -> str | None:
        with taking:
            return None if ending.is_set() else next(pieces, None)

    def work(number: int) -> None:
        while (piece := next_piece()) is not None:
            do(number, piece)

    if at_once == 1:  # here, where Ctrl-C arrives
        work(0)
        return
    with ThreadPoolExecutor(at_once) as pool:
        try:
            for one in as_completed([pool.submit(work, number) for number in range(at_once)]):
                one.result()
        except BaseException:
            ending.set()
            on_interrupt()
            raise


def _among(names: Iterable[str], pieces: Sequence[str]) -> tuple[str, ...]:
    known = set(pieces)
    return tuple(name for name in names if name in known)


def _print(line: str) -> None:
    print(line, flush=True)
