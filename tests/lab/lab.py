"""What a scenario is given: machines with nondum on them, and sticks to plug into them."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tests.kit.payloads import Part, make_payload, sdk_wheel
from tests.lab.building import Built, built
from tests.lab.drives import fat_stick
from tests.lab.fleet import Fleet
from tests.lab.installed import NAME, Installed
from tests.lab.machine import Machine
from tests.lab.network import Lan
from tests.lab.recipe import recipe
from tests.lab.software import FOR_PAYLOADS, software


@dataclass
class Lab:
    """The laboratory of one run. One machine serves scenario after scenario until it fails one."""

    built: Built
    software: Path
    """The disk with nondum on it."""
    commit: str | None
    """What nondum is as of; None: as the checkout is now."""
    work: Path
    """A folder with a short path, for all that is made on the way."""
    brought: Path | None = None
    """A payload, or a drive, from the user of the laboratory."""
    is_alone: bool = True
    """Whether nothing else runs beside it, so that what is measured goes into the documents."""
    machines: list[Machine] = field(default_factory=list)
    """Every machine that was switched on in the present scenario, the shared one first."""
    all_machines: list[Machine] = field(default_factory=list)
    boots_s: list[float] = field(default_factory=list)
    """How long each boot took."""
    _shared: Installed | None = None
    _lans: list[Lan] = field(default_factory=list)
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
        machine = self._machine(self.built, self.software)
        (host,) = self._switched_on({NAME: machine})
        return host

    def bare(self, *disks: Path) -> Machine:
        """A machine of the scenario's own, switched on, with nothing but these disks."""
        machine = self._machine(self.built, *disks)
        self.boots_s.append(machine.boot())
        machine.wait_for_system()
        return machine

    def fleet(
        self, *names: str, memory_mb: int = 1024, of: Mapping[str, str] | None = None
    ) -> dict[str, Installed]:
        """Machines of the scenario's own on one network, each with a host of that name; all are
        started, and certified by one fleet, by which they let each other in. `of`: the architecture
        of those that are not of the run's."""
        lan = Lan()
        self._lans.append(lan)
        machines = {}
        for name in names:
            root, disk = self._made((of or {}).get(name, self.built.recipe.architecture))
            machines[name] = self._machine(root, disk, memory_mb=memory_mb, socket=lan.socket())
        hosts = self._switched_on(machines)
        fleet = Fleet(self.work / f"fleet-{next(self._numbers)}")
        for host in hosts:
            host.begin_to_start()
        for host in hosts:
            host.start()
            fleet.admit(host)
        return dict(zip(names, hosts, strict=True))

    def _made(self, architecture: str) -> tuple[Built, Path]:
        """What a machine is started from, and the disk with nondum on it."""
        if architecture == self.built.recipe.architecture:
            return self.built, self.software
        other = built(recipe(architecture, self.built.recipe.suite))
        return other, software(other, self.commit)

    def _machine(self, root: Built, *disks: Path, **options: Any) -> Machine:
        work = self.work / f"m{next(self._numbers)}"
        machine = Machine(root, work, drives=disks, **options)
        self.machines.append(machine)
        self.all_machines.append(machine)
        return machine

    def _switched_on(self, machines: Mapping[str, Machine]) -> list[Installed]:
        """Machines, by the names of their hosts; they boot together."""
        began_s = time.monotonic()
        for machine in machines.values():
            machine.switch_on()
        hosts = [Installed(machine, name) for name, machine in machines.items()]
        for host in hosts:
            host.machine.until_booted()
            self.boots_s.append(time.monotonic() - began_s)
            host.machine.wait_for_system()
            host.install()
        return hosts

    def cpu_s(self) -> float:
        """Processor time that all machines took so far."""
        return sum(machine.cpu_s for machine in self.all_machines)

    def replugs(self) -> int:
        """How often a drive was plugged in again so far, because it stalled."""
        return sum(machine.replugs for machine in self.all_machines)

    def stick(self, name: str, *parts: Part, **options: Any) -> Path:
        """The image of a stick that carries one payload, `org.example.<name>`."""
        content = self.payload(name, *parts, **options)
        return fat_stick(content.parent / "stick.img", content)

    def payload(self, name: str, *parts: Part, **options: Any) -> Path:
        """The content of such a stick: a folder, in a new folder."""
        content = self.folder() / "files"
        fitting = [self._fitting(part) for part in parts]
        make_payload(content, *fitting, payload_id=f"org.example.{name}", **options)
        return content

    def _fitting(self, part: Part) -> Part:
        """The part with the SDK for the machines' processor, which may be another than ours."""
        if not part.with_sdk:
            return part
        needed = sorted((self.software.parent / FOR_PAYLOADS).iterdir())
        return replace(part, with_sdk=False, wheels=(*part.wheels, sdk_wheel(), *needed))

    def folder(self) -> Path:
        """A new folder, for what is made on the way."""
        folder = self.work / f"stick-{next(self._numbers)}"
        folder.mkdir(parents=True)
        return folder

    @contextmanager
    def scenario(self) -> Iterator[None]:
        """For the time of one scenario: whatever it switched on for itself is off afterwards, and
        the shared machine as well should the scenario have failed; else nothing is plugged in."""
        self.machines = []
        try:
            yield
        except BaseException:
            self.close()
            raise
        for machine in self.machines:
            if self._shared is not None and machine is self._shared.machine:
                machine.unplug_all()
            else:
                machine.close()
        self._remove_lans()

    def close(self) -> None:
        """Switch everything off."""
        shared = [self._shared.machine] if self._shared is not None else []
        for machine in (*self.machines, *shared):
            machine.close()
        self._shared = None
        self._remove_lans()

    def _remove_lans(self) -> None:
        while self._lans:
            self._lans.pop().close()
