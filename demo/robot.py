"""One host as a person meets it: a daemon with slots for drives and devices, and views of it.

What another kind of host would do otherwise (one in a machine of the laboratory) is in methods.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from nondum.host.control.client import ControlClient
from nondum.sdk.errors import HostUnreachable, NondumError

_T = TypeVar("_T")
View = Mapping[str, Any]
NONDUM = [sys.executable, "-m", "nondum.cli"]


class TooLate(Exception):
    """Something awaited did not come in time; says what, and what the host said last."""


class Robot:
    """A running host. Make one with `running`."""

    slowness = 1.0
    """How much longer than usual things may take here."""

    def __init__(self, work: Path, *, name: str) -> None:
        self.work = work
        self.name = name
        self.slots = work / "slots"
        self.devices = work / "device-slots"
        self.control = work / "control.sock"
        self.process: subprocess.Popen[bytes] | None = None
        """The daemon, where `running` has started it."""
        self._view: View = {}
        self._changed = threading.Condition()
        self._watching = True

    def plug(self, drive: Path) -> str:
        """Insert a drive; returns its name, to pull it by."""
        (self.slots / drive.name).symlink_to(drive)
        return drive.name

    def pull(self, name: str) -> None:
        """Yank a drive."""
        (self.slots / name).unlink()

    @property
    def plugged(self) -> set[str]:
        """The names of the drives that are in."""
        return {path.name for path in self.slots.iterdir()}

    def payloads_on(self, drives: Collection[str], view: View | None = None) -> list[View]:
        """The rows of the payloads that drives of these names carry, in the latest view."""
        rows = (self.view if view is None else view)["payloads"]
        return [row for row in rows if {*drives} & {*row["drive"].split(", ")}]

    def components_on(self, drives: Collection[str]) -> set[str]:
        """The components of the payloads that drives of these names carry."""
        return {id for row in self.payloads_on(drives) for id in row["components"]}

    def deliver(self, file: Path, folder: Path) -> None:
        """Copy a file into a folder of its machine, at once and whole."""
        unfinished = Path(shutil.copy(file, folder / f".{file.name}.part"))
        unfinished.rename(folder / file.name)

    def written(self, folder: Path, since_s: float) -> list[tuple[float, Path]]:
        """The files that were written to a folder of its machine since a time of `now_s`: when,
        oldest first, and where they can be read here."""
        found = ((path.stat().st_mtime, path) for path in folder.glob("*.wav"))
        return sorted(entry for entry in found if entry[0] >= since_s)

    def now_s(self) -> float:
        """Seconds since 1970, by its machine's clock."""
        return time.time()

    def nondum(self, *words: str) -> str:
        """Run the command line for this host, and return what it printed."""
        return nondum("--control", self.control, *words)

    def ask(self, verb: str, **arguments: Any) -> Any:
        """Ask the daemon. Raises `NondumError` with its refusal."""
        with ControlClient(self.control) as client:
            return client.ask(verb, **arguments)

    @property
    def view(self) -> View:
        """The latest view."""
        with self._changed:
            return self._view

    def told_number(self) -> int:
        """Number of the last sentence that the host told."""
        return max((row["number"] for row in self.view.get("told", ())), default=0)

    def told_since(self, number: int) -> tuple[str, ...]:
        """What it has told after the sentence of that number."""
        told = self.view.get("told", ())
        return tuple(row["text"] for row in told if row["number"] > number)

    def until(
        self, what: str, found: Callable[[View], _T | None], *, timeout_s: float = 60.0
    ) -> _T:
        """Wait until a view satisfies `found`, and return what it found. Raises `TooLate`."""
        result: list[_T] = []

        def look() -> bool:
            answer = found(self._view) if self._view else None
            if answer is not None and answer is not False:
                result.append(answer)
            return bool(result) or not self._watching

        with self._changed:
            self._changed.wait_for(look, timeout=timeout_s * self.slowness)
        if not result:
            raise TooLate(
                f"{what}: not within {timeout_s * self.slowness:.0f} s\n{self._last_words()}"
            )
        return result[0]

    def see(self, view: View) -> None:
        """Take in a newer view: everyone who waits looks at it."""
        with self._changed:
            self._view = view
            self._changed.notify_all()

    def watch(self) -> None:
        """Keep `view` fresh until the host leaves; runs in its own thread."""
        try:
            for view in self.shown():
                self.see(view)
        finally:
            with self._changed:
                self._watching = False
                self._changed.notify_all()

    def shown(self) -> Iterator[View]:
        """What is to be seen, whenever it changes, until the host leaves."""
        try:
            with ControlClient(self.control, timeout_s=None) as client:
                yield from client.follow("watch")
        except HostUnreachable:
            pass  # the daemon was stopped: `until` says so

    def _last_words(self) -> str:
        try:
            why = self.ask("why")
        except NondumError as error:
            return str(error)
        return "\n".join([*why["sentences"], *map(str, why["problems"])])


def nondum(*arguments: str | Path) -> str:
    """Run the command line, and return what it printed. Its refusals are shown as they are."""
    done = subprocess.run([*NONDUM, *map(str, arguments)], stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise SystemExit(done.returncode)
    return done.stdout


@contextmanager
def running(
    work: Path,
    *,
    name: str,
    initial: Mapping[str, Path],
    trust: Path | None = None,
    more: str = "",
    inside: Sequence[str] = (),
) -> Iterator[Robot]:
    """A host with initial components, started and at last stopped.

    `trust` is the trust file that it is given; without one, it takes any payload. `more` are
    further lines of its configuration; `inside` is what runs commands on its machine, if that is
    not this one.
    """
    robot = Robot(work, name=name)
    for folder in (robot.slots, robot.devices):
        folder.mkdir(parents=True)
    config = work / "host.toml"
    config.write_text(configuration(robot, trust) + more, encoding="utf-8")
    command = [*inside, *NONDUM, "host", "run", "--user", "--config", str(config)]
    with (work / "daemon.log").open("wb") as log:
        daemon = robot.process = subprocess.Popen(command, stdout=log, stderr=log)
        try:
            _await_socket(robot, daemon)
            for drive in initial.values():
                nondum("--control", robot.control, "payload", "install", drive)
            watcher = threading.Thread(target=robot.watch, daemon=True)
            watcher.start()
            robot.until("the first view", bool, timeout_s=20)
            yield robot
        finally:
            daemon.terminate()
            daemon.wait(timeout=20)


def configuration(robot: Robot, trust: Path | None = None) -> str:
    """The configuration of a robot: slots instead of real ports, and the trust file; without one,
    unsigned payloads are allowed."""
    believes = "allow_unsigned = true" if trust is None else f'[trust]\nfile = "{trust}"'
    return f"""\
[host]
name = "{robot.name}"
state = "{robot.work / "state"}"
control = "{robot.control}"

[drives]
slots = ["{robot.slots}"]
block_devices = false
{believes}

[devices]
slots = ["{robot.devices}"]
udev = false
"""


def _await_socket(robot: Robot, daemon: subprocess.Popen[bytes]) -> None:
    done = threading.Event()
    for _ in range(round(300 * robot.slowness)):
        if daemon.poll() is not None:
            break
        try:
            robot.ask("status")
            return
        except HostUnreachable:
            done.wait(0.1)
    raise TooLate("the daemon did not answer:\n" + (robot.work / "daemon.log").read_text())
