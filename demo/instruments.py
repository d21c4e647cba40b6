"""The instruments of one pointing run: emulators switched on, plugged in, and judged afterwards."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from demo import slots
from demo.pointing import Score, Truth, read_log, score
from demo.scenario import Scenario

EMULATORS = Path(__file__).parent / "emulators"
LOG_DEADLINE_S = 5.0
SWITCHED_S = 30.0
_PORTS = (("camera",), ("head", "relay"))
"""Of each emulator, in the order that it names them in."""
_ADAPTERS = {
    "camera": slots.COMPTON_CAMERA,
    "head": slots.PAN_TILT_UNIT,
    "relay": slots.LASER_RELAY,
}


@dataclass(frozen=True, slots=True)
class Instruments:
    """Emulators that run; made by `switched_on`, which also ends them."""

    scenario: Scenario
    nodes: dict[str, str]
    """`camera`, `head` and `relay` → the terminal, or the unix socket, that each is on."""
    log: Path

    def plug(self, folder: Path) -> None:
        """Plug all three into a folder of device slots."""
        for name, node in self.nodes.items():
            slots.plug(folder, name, node, _ADAPTERS[name])

    def unplug(self, folder: Path) -> None:
        """Pull them out again."""
        for name in self.nodes:
            slots.unplug(folder, name)

    def switched(self, *, on: bool) -> float:
        """Wait until the laser is on, or off, and say when it was so for certain (monotonic clock):
        relays do not answer, and what a driver has sent may be on its way. Raises `TimeoutError`.
        """
        deadline = time.monotonic() + SWITCHED_S
        while time.monotonic() < deadline:
            truths = read_log(self.log)
            if truths and truths[-1].laser is on:
                return truths[-1].at_s
            time.sleep(0.02)  # a plain file does not notify its readers when it grows
        raise TimeoutError(f"the laser is not switched {'on' if on else 'off'}")

    def score(self, end_s: float) -> Score:
        """Judge the second before `end_s` (monotonic clock), once that time has come."""
        return score(self.scenario, self._truths(end_s), end_s=end_s)

    def _truths(self, until_s: float) -> list[Truth]:
        """The log, when it reaches that time; a dead emulator's as it is."""
        deadline = max(until_s, time.monotonic()) + LOG_DEADLINE_S
        while True:
            truths = read_log(self.log)
            if (truths and truths[-1].at_s >= until_s) or time.monotonic() > deadline:
                return truths
            time.sleep(0.02)  # a plain file does not notify its readers when it grows


@contextmanager
def switched_on(
    scenario: Scenario, folder: Path, *, sockets: bool = False
) -> Iterator[Instruments]:
    """Start the emulators of a scenario; truth and log are kept in `folder`, and their sockets,
    where they are to listen at such instead of being on terminals."""
    truth, log = folder / "truth.json", folder / "truth-log.jsonl"
    scenario.write(truth)
    log.touch()
    with ExitStack() as programs:
        at = [[str(folder / name) for name in names] if sockets else [] for names in _PORTS]
        (camera,) = programs.enter_context(_program("compton_emulator", truth, at[0], paths=1))
        unit = _program("ptu_emulator", truth, at[1], "--log", str(log), paths=2)
        head, relay = programs.enter_context(unit)
        yield Instruments(scenario, {"camera": camera, "head": head, "relay": relay}, log)


@contextmanager
def _program(
    name: str, truth: Path, at: Sequence[str], *options: str, paths: int
) -> Iterator[list[str]]:
    """A running emulator; the paths that it printed."""
    where = ["--at", *at] if at else []
    program = [sys.executable, str(EMULATORS / f"{name}.py"), "--scenario", str(truth)]
    command = [*program, *options, *where]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        try:
            assert running.stdout is not None
            yield [running.stdout.readline().strip() for _ in range(paths)]
        finally:
            running.terminate()
