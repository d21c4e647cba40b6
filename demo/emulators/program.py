"""The emulators as programs: their arguments and ports, and a clock that ends with the parent
process."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from demo.emulators.port import Port
from demo.emulators.socket_port import SocketPort
from demo.scenario import Scenario


@dataclass(frozen=True, slots=True)
class Arguments:
    scenario: Scenario
    log: Path | None
    at: tuple[Path, ...]
    """Where unix sockets are to be, in the order of the ports; none: pseudo-terminals."""
    parent: int
    """The process that started this one, read before it can be told of anything to wait for."""


def arguments(about: str) -> Arguments:
    """The command line of an emulator: `--scenario FILE [--log FILE] [--at SOCKET…]`."""
    parent = os.getppid()
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--scenario", type=Path, required=True, help="the truth, as JSON")
    parser.add_argument("--log", type=Path, help="what really happened, as JSON lines")
    parser.add_argument("--at", type=Path, nargs="+", default=(), help="unix sockets to listen at")
    given = parser.parse_args()
    return Arguments(Scenario.read(given.scenario), given.log, tuple(given.at), parent)


def ports(given: Arguments, number: int) -> list[Port | SocketPort]:
    """The ports of an instrument that has `number` of them."""
    if not given.at:
        return [Port() for _ in range(number)]
    return [SocketPort(path) for _, path in zip(range(number), given.at, strict=True)]


def ticks(period_s: float, parent: int) -> Iterator[float]:
    """Yield how long to wait for input at every turn, for as long as process `parent` lives.

    Turns are `period_s` of the monotonic clock apart on average, however long the work takes.
    """
    due = time.monotonic()
    while os.getppid() == parent:
        due += period_s
        yield max(0.0, due - time.monotonic())
