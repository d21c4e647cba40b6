"""Insertion into a running host: from the drive's entry in a slot to the component that is ready.

What is timed is the whole way: the insertion is noticed, the payload copied, verified and
installed, its worker started and asked what it is, and the catalogue committed and shown.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import struct
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchmarks.recompose.processes import await_rest, descendants, pss_mb
from demo.robot import Robot, TooLate, View, running

TIMEOUT_S = 900.0
"""Emulated processors that others share are slow."""
PHASES = ("seen", "verified", "installed", "ready")
"""As the host's journal has them."""

_LOOK_S = 0.2


@dataclass(frozen=True, slots=True)
class Insertion:
    """How long one took, in seconds from the moment before the drive went in."""

    ready_s: float
    """When the component was shown as ready to somebody who watches."""
    planned_s: float
    """When a goal given then by that somebody had a plan with the payload's behaviour in it."""
    phases_s: Mapping[str, float]
    """Phase → when the journal has it complete."""


@dataclass(frozen=True, slots=True)
class Memory:
    """Proportional set sizes of a host at rest with one payload, in MB."""

    daemon: float
    """The process that runs the host."""
    worker: float
    spares: float
    """Processes that are kept warm for the next job."""


@contextmanager
def fresh_host(work: Path) -> Iterator[Robot]:
    """A host that has never seen a payload, at rest."""
    with running(work, name="bench", initial={}) as robot:
        robot.until("an idle host", lambda view: view["state"] == "ready", timeout_s=TIMEOUT_S)
        await_rest(daemon(robot), timeout_s=TIMEOUT_S)
        yield robot


def insert(robot: Robot, drive: Path, component: str, goal: str) -> Insertion:
    """Plug a drive in, wait until its component is ready, have it planned with, await rest."""
    began_s = time.monotonic()
    robot.plug(drive)
    shown = robot.until(f"{component} ready", _ready(component), timeout_s=TIMEOUT_S)
    ready_s = time.monotonic() - began_s
    robot.ask("goal", words=goal)
    robot.until(f"a plan for {goal!r}", _planned(component), timeout_s=TIMEOUT_S)
    planned_s = time.monotonic() - began_s
    _await(lambda: _is_compiled(robot), f"{drive.name} is not compiled")
    await_rest(daemon(robot), timeout_s=TIMEOUT_S)
    phases = {name: shown["phases"][name] - began_s for name in PHASES}
    return Insertion(ready_s, planned_s, phases)


def remove(robot: Robot, drive: Path) -> None:
    """Pull a drive and wait until all is done that a host does in its idle moments afterwards: it
    has the wheels in its store, and what it made of them in its cache."""
    robot.pull(drive.name)
    _await(lambda: not robot.ask("status")["payloads"], f"{drive.name} is not forgotten")
    _await(lambda: _is_cached(robot), f"{drive.name} is not cached")
    await_rest(daemon(robot), timeout_s=TIMEOUT_S)


def at_rest(robot: Robot, component: str) -> Memory:
    """What a host takes that has a payload and nothing to do."""
    (worker,) = (row["pid"] for row in robot.ask("components") if row["component"] == component)
    host = daemon(robot)
    spares = [pid for pid in descendants(host) if pid != worker]
    return Memory(pss_mb(host), pss_mb(worker), sum(pss_mb(pid) for pid in spares))


def _await(is_done: Callable[[], bool], otherwise: str) -> None:
    """Wait for what no view tells of. Raises `TooLate`."""
    until_s = time.monotonic() + TIMEOUT_S
    while not is_done():
        if time.monotonic() > until_s:
            raise TooLate(otherwise)
        time.sleep(_LOOK_S)


def _is_compiled(robot: Robot) -> bool:
    """Whether all that the store has is compiled, as far as it can be: that comes last."""
    _hasten(robot)
    manifests = [*(robot.work / "state/store").glob("[!.]*/manifest.json")]
    return bool(manifests) and all(json.loads(m.read_bytes())["compiled"] for m in manifests)


def _is_cached(robot: Robot) -> bool:
    """Whether the venvs of what was pulled are made."""
    _hasten(robot)
    return next((robot.work / "state/cache").glob("*/venvs/[!.]*"), None) is not None


def _hasten(robot: Robot) -> None:
    """Raise the priority of what a host leaves to idle moments, which a machine that has other work
    may not have for minutes."""
    for pid in descendants(daemon(robot)):
        with contextlib.suppress(OSError):  # it has just ended, or it may not be done
            if os.sched_getscheduler(pid) == os.SCHED_IDLE:
                os.sched_setscheduler(pid, os.SCHED_OTHER, os.sched_param(0))


def daemon(robot: Robot) -> int:
    """The process at the other end of a host's control socket (SO_PEERCRED, unix(7))."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.connect(str(robot.control))
        said = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
    pid: int = struct.unpack("3i", said)[0]
    return pid


def _ready(component: str) -> Callable[[View], View | None]:
    """Gives the payload's row once the component is ready."""

    def found(view: View) -> View | None:
        states = {row["component"]: row["state"] for row in view["components"]}
        rows = (row for row in view["payloads"] if component in row["components"])
        return next(rows, None) if states.get(component) == "ready" else None

    return found


def _planned(component: str) -> Callable[[View], bool]:
    return lambda view: any(component in step["action"] for step in view["plan"]["steps"])
