"""The first demonstration on a machine: its payloads on sticks, its base installed, its emulated
instruments at the far ends of serial adapters, its body and images heard as people hear them.

What judges is the demonstration's own (`demo`): it is given what nondum's command line printed.
"""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from demo import slots
from demo.drives import Target
from demo.instruments import Instruments, switched_on
from demo.kit import Kit, set_up
from demo.one_host import LIBRARIES
from demo.scenario import Scenario
from tests.lab.installed import Installed
from tests.lab.lab import Lab
from tests.lab.robot import MachineRobot

RULES = "/etc/udev/rules.d/70-emulated-instruments.rules"
ADAPTERS = {
    "camera": slots.COMPTON_CAMERA,
    "head": slots.PAN_TILT_UNIT,
    "relay": slots.LASER_RELAY,
}


def kit(
    lab: Lab, names: Sequence[str], settings: Mapping[str, str], *, later: Sequence[str] = ()
) -> Kit:
    """Build payloads for the lab's machines, and for Pythons that these will have later; `settings`
    are lines of plugins' settings, by name."""
    folders = {name: set_up(name, lab.work / "sources", text) for name, text in settings.items()}
    target = Target((lab.built.recipe.python, *later), (lab.built.recipe.architecture,))
    return Kit.built(names, libraries=LIBRARIES, folders=folders, target=target)


def robot(lab: Lab, made: Kit, initial: str) -> MachineRobot:
    """A host that trusts the demonstrations' maker, with its initial component."""
    host = lab.booted()
    host.start()
    met = MachineRobot(host, {made.drives[name].name: id for name, id in made.payloads.items()})
    threading.Thread(target=met.watch, daemon=True).start()
    met.until("the first view", bool)
    met.trust(made.trust)
    met.install(made.drives[initial])
    return met


@contextmanager
def instruments(host: Installed, scenario: Scenario, folder: Path) -> Iterator[Instruments]:
    """Emulated instruments, switched on but not plugged in.

    QEMU's adapters all say that they are one model; rules of udev's give each the name that its
    instrument's would have, by its serial number.
    """
    folder.mkdir()
    host.machine.put(RULES, "".join(_rule(name) for name in ADAPTERS))
    host.machine.run("udevadm control --reload")
    try:
        with switched_on(scenario, folder, sockets=True) as switched:
            yield switched
    finally:
        host.machine.run(f"rm {RULES}; udevadm control --reload")


def plug(host: Installed, switched: Instruments) -> list[str]:
    """Plug all instruments in; what to pull them by."""
    nodes = switched.nodes.items()
    return [host.machine.plug_line(Path(at), serial=serial(name)) for name, at in nodes]


def serial(name: str) -> str:
    """The serial number of an instrument's adapter."""
    return ADAPTERS[name]["ID_SERIAL"].rpartition("_")[2]


class FollowedStream:
    """A stream, as `nondum streams --follow` shows it in the machine, until the stream ends."""

    def __init__(self, host: Installed, kind: str) -> None:
        """Begin to follow the only stream of a type."""
        self._machine = host.machine
        rows = json.loads(host.machine.run("nondum streams --json"))
        (stream,) = [row["stream"] for row in rows if row["type"] == kind]
        self._log = f"/run/heard-{kind}"
        self._read = 0
        """Bytes of it; what was read is kept, since to read it again costs the machine more each
        time."""
        self._rows: list[dict[str, Any]] = []
        unit = f"heard-{kind}"
        self._machine.run(
            f"systemctl stop {unit} 2>/dev/null; rm -f {self._log};"
            f" systemd-run -q --collect --unit={unit} -p StandardOutput=file:{self._log}"
            f" /usr/local/bin/nondum streams --follow {stream} --json"
        )

    def rows(self) -> list[dict[str, Any]]:
        """All messages so far."""
        new, _, _ = self._machine.run(f"tail -c +{self._read + 1} {self._log}").rpartition("\n")
        if new:
            self._read += len(new.encode()) + 1
            self._rows += map(json.loads, new.split("\n"))
        return list(self._rows)


def headings(rows: Sequence[Mapping[str, Any]]) -> list[tuple[float, float]]:
    """Stamp and yaw of a body, by its odometry."""
    return [(row["stamp_s"], _yaw(row["fields"]["orientation"])) for row in rows]


def places(rows: Sequence[Mapping[str, Any]]) -> list[tuple[float, float, float]]:
    """Stamp and place of a body, by its odometry."""
    return [(row["stamp_s"], *row["fields"]["position"][:2]) for row in rows]


def frames(rows: Sequence[Mapping[str, Any]]) -> list[tuple[float, int]]:
    """Stamp and number of images."""
    return [(row["stamp_s"], row["seq"]) for row in rows]


def _yaw(orientation: Sequence[float]) -> float:
    x, y, z, w = orientation
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _rule(name: str) -> str:
    given = [f'ENV{{{key}}}="{value}"' for key, value in ADAPTERS[name].items()]
    which = f'SUBSYSTEM=="tty", ENV{{ID_SERIAL_SHORT}}=="{serial(name)}"'
    return ", ".join([which, *(one for one in given if "SUBSYSTEM" not in one)]) + "\n"
