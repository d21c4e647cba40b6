"""A daemon is played with from outside: plugged, pulled, stopped, and traced meanwhile.

What it has come to is read from its catalogue, so that nothing of the player is hit by what is done
to the daemon.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sqlite3
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from demo.robot import TooLate
from tests.kit.until import until

PATIENCE_S = 30.0

_AT_REST = ("active", "superseded", "refused", "quarantined")


class Stuck(Exception):
    """The daemon lives and does not come to rest."""


@dataclass
class Player:
    """Acts on one daemon from outside; give `play` to `Nursery.run`."""

    root: Path
    script: Sequence[str] = ("plug a", "pull a")
    before: Callable[[int], object] = lambda pid: None
    """Called with its pid once it is up, and before anything is plugged in."""
    between: Mapping[int, Callable[[int], object]] = field(default_factory=dict)
    """Number of a line of the script → what is called with the pid before it."""
    late_s: float | None = None
    """When it is killed after that; None: it may go on to the end."""
    stuck: str = ""
    """What it did not come to rest at."""

    def play(self, pid: int) -> None:
        try:
            self._until(pid, "start", self._is_up)
            self.before(pid)
            begun = time.monotonic()
            for number, line in enumerate((*self.script, "end")):
                if number in self.between:
                    self.between[number](pid)
                what, *slots = line.split()
                for slot in slots:
                    place = self.root / "slots" / slot
                    if what == "plug":
                        place.symlink_to(self.root / "drives" / slot)
                    else:
                        place.unlink()
                self._until(pid, line, self._is_settled, begun)
            os.kill(pid, signal.SIGTERM)
            with contextlib.suppress(Stuck):
                self._until(pid, "SIGTERM", lambda: False)
            # The write(2) by which a signal wakes the loop may have failed, or the daemon
            # has stopped and waits for a thread that could not start.
            os.kill(pid, signal.SIGTERM)
            self._until(pid, "a second SIGTERM", lambda: False)
        except ProcessLookupError:
            pass
        except Stuck as stuck:
            self.stuck = str(stuck)
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def _until(
        self, pid: int, what: str, holds: Callable[[], bool], begun: float | None = None
    ) -> None:
        """Wait for something. Raises `ProcessLookupError` once the daemon is dead, and `Stuck`."""

        def is_over() -> bool:
            if holds():
                return True
            if self.late_s is not None and begun and time.monotonic() - begun > self.late_s:
                os.kill(pid, signal.SIGKILL)
                raise ProcessLookupError
            if is_dead(pid):
                raise ProcessLookupError
            return False

        try:
            until(what, is_over, patience_s=PATIENCE_S)
        except TooLate as late:
            raise Stuck(what) from late

    def _is_up(self) -> bool:
        return bool(self._ask("SELECT 1 FROM journal WHERE event = 'DrivesScanned'"))

    def _is_settled(self) -> bool:
        drives = {row[0]: row[1] for row in self._ask("SELECT id, state FROM drives")}
        steps = [step for (step,) in self._ask("SELECT step FROM payloads")]
        return (
            {path.name for path in (self.root / "slots").iterdir()} == set(drives)
            and set(drives.values()) <= {"idle"}
            and set(steps) <= set(_AT_REST)
        )

    def _ask(self, query: str) -> list[tuple[str, ...]]:
        file = self.root / "state/catalogue.sqlite"
        if not file.exists():
            return []
        with contextlib.closing(sqlite3.connect(file, timeout=5.0)) as connection:
            try:
                return connection.execute(query).fetchall()
            except sqlite3.OperationalError:  # its tables are not made yet
                return []


def is_dead(pid: int) -> bool:
    """Whether a process has ended."""
    try:
        return "\nState:\tZ" in Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return True


def trace(pid: int, *options: str) -> subprocess.Popen[bytes]:
    """Have strace(1) at a daemon and all that it starts; it goes when they do. Wait for it."""
    command = ["strace", "-f", "-qq", "-p", str(pid), *options]
    strace = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    until("strace attached", lambda: strace.poll() is not None or _is_traced(pid))
    return strace


def _is_traced(pid: int) -> bool:
    try:
        tasks = list(Path(f"/proc/{pid}/task").iterdir())
        return all("TracerPid:\t0" not in (task / "status").read_text() for task in tasks)
    except OSError:
        return True


def has_stopped(root: Path) -> bool:
    """Whether the last daemon ended because it was told to, as far as its journal goes."""
    with contextlib.closing(sqlite3.connect(root / "state/catalogue.sqlite")) as connection:
        last = connection.execute("SELECT event FROM journal ORDER BY id DESC LIMIT 1").fetchone()
    return bool(last) and last[0] == "HostStopped"


def codes_of(root: Path) -> list[str]:
    """Codes of all problems in the journal."""
    with contextlib.closing(sqlite3.connect(root / "state/catalogue.sqlite")) as connection:
        query = "SELECT p.value ->> 'code' FROM journal, json_each(journal.problems) AS p"
        return [code for (code,) in connection.execute(query)]
