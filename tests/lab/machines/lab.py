"""What a scenario is given: machines with nondum on them, and sticks to plug into them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.lab.machines.building import Built
from tests.lab.machines.drives import fat_stick
from tests.lab.machines.installed import Installed
from tests.lab.machines.machine import Machine
from tests.payloads import Part, make_payload


@dataclass
class Lab:
    """The laboratory of one run. One machine serves scenario after scenario until it fails one."""

    built: Built
    software: Path
    """The disk with nondum on it."""
    work: Path
    """A folder with a short path, for all that is made on the way."""
    machines: list[Machine] = field(default_factory=list)
    """Every machine that was switched on in the present scenario, the shared one first."""
    all_machines: list[Machine] = field(default_factory=list)
    boots_s: list[float] = field(default_factory=list)
    """How long each boot took."""
    _shared: Installed | None = None
    _numbers: Iterator[int] = field(default_factory=itertools.count)

    def host(self, *, more: str = "") -> Installed:
        """A host that has just started and knows nothing; `more` are lines of the table `[workers]`
        of its configuration."""
        host = self.booted_once()
        host.forget()
        host.configure(more)
        host.start()
        return host

    def booted_once(self) -> Installed:
        """The machine that scenarios share; nothing is started."""
        if self._shared is None:
            self._shared = self.booted()
        elif self._shared.machine not in self.machines:
            self.machines.append(self._shared.machine)
        return self._shared

    def booted(self) -> Installed:
        """A machine of the scenario's own, switched on, with nondum installed but not started."""
        machine = Machine(
            self.built, self.work / f"m{next(self._numbers)}", drives=(self.software,)
        )
        self.machines.append(machine)
        self.all_machines.append(machine)
        self.boots_s.append(machine.boot())
        machine.wait_for_system()
        installed = Installed(machine)
        installed.install()
        return installed

    def cpu_s(self) -> float:
        """Processor time that all machines took so far."""
        return sum(machine.cpu_s for machine in self.all_machines)

    def stick(self, name: str, *parts: Part, **options: Any) -> Path:
        """The image of a stick that carries one payload, `org.example.<name>`."""
        content = self.payload(name, *parts, **options)
        return fat_stick(content.parent / "stick.img", content)

    def payload(self, name: str, *parts: Part, **options: Any) -> Path:
        """What is on such a stick: a folder, in a folder of its own."""
        content = self.folder() / "files"
        make_payload(content, *parts, payload_id=f"org.example.{name}", **options)
        return content

    def folder(self) -> Path:
        """A new folder, for what is made on the way."""
        folder = self.work / f"stick-{next(self._numbers)}"
        folder.mkdir(parents=True)
        return folder

    @contextmanager
    def scenario(self) -> Iterator[None]:
        """For the time of one scenario: whatever it switched on for itself is off afterwards, and
        the shared machine as well should the scenario have failed."""
        self.machines = []
        try:
            yield
        except BaseException:
            self.close()
            raise
        for machine in self.machines:
            if self._shared is None or machine is not self._shared.machine:
                machine.close()

    def close(self) -> None:
        """Switch everything off."""
        shared = [self._shared.machine] if self._shared is not None else []
        for machine in (*self.machines, *shared):
            machine.close()
        self._shared = None
