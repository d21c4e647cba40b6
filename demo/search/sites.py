"""Where three hosts run: in their own network, or, without root, on this machine's loopback."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Protocol

from demo.namespaces import Cable, Machine, NamespacesUnavailable, Network
from demo.ports import free_port
from demo.robot import Robot
from demo.search.fleet import Fleet


class Site(Protocol):
    """Where hosts are started."""

    @property
    def told(self) -> str:
        """What it is, for people."""
        ...

    @property
    def lost(self) -> str:
        """What `lose` does, for people: a noun."""
        ...

    def prepare(self, name: str, state: Path) -> str:
        """Make a host one of these, before it is started; its lines of configuration."""
        ...

    def command_prefix(self, name: str) -> Sequence[str]:
        """The words before a command that runs it on that host's machine."""
        ...

    def lose(self, robot: Robot) -> None:
        """Let a host vanish for the others, without a word."""
        ...


class Lan:
    """Machines with one network each, joined by a switch; keys, and a fleet that certifies them."""

    told = "three network namespaces and a switch, CURVE keys, certificates of a fleet, multicast"
    lost = "the pull of its network cable"

    def __init__(self, work: Path, network: Network, names: Sequence[str]) -> None:
        self._fleet = Fleet(work / "fleet")
        switch = network.switch()
        self._machines: dict[str, Machine] = {name: network.machine(name) for name in names}
        self._cables: dict[str, Cable] = {
            name: network.plug(machine, switch) for name, machine in self._machines.items()
        }

    def prepare(self, name: str, state: Path) -> str:
        """Certify it."""
        self._fleet.admit(name, state)
        return "\n[peers]\nenabled = true\n"

    def command_prefix(self, name: str) -> Sequence[str]:
        """They enter its namespace."""
        return self._machines[name].command()

    def lose(self, robot: Robot) -> None:
        """Pull its cable."""
        self._cables[robot.name].pull()


class Loopback:
    """Processes of one machine, which know each other's ports and ask for no keys."""

    told = "one machine's loopback, static hosts, development mode (no keys)"
    lost = "SIGKILL to its daemon"

    def __init__(self, names: Sequence[str]) -> None:
        self._ports = {name: free_port() for name in names}

    def prepare(self, name: str, state: Path) -> str:
        """Tell it the others' ports."""
        others = [f"127.0.0.1:{port}" for other, port in self._ports.items() if other != name]
        return (
            "\n[peers]\nenabled = true\ndevelopment = true\ndiscover = false\n"
            f'listen = ["tcp://127.0.0.1:{self._ports[name]}"]\nstatic = {others}\n'
        )

    def command_prefix(self, name: str) -> Sequence[str]:
        """None: its commands run here."""
        return ()

    def lose(self, robot: Robot) -> None:
        """Kill its daemon."""
        assert robot.process is not None, "it was never started"
        robot.process.kill()


@contextmanager
def site(work: Path, names: Sequence[str], *, is_loopback: bool) -> Iterator[Site]:
    """Machines for hosts of these names: namespaces where this user may make them, unless
    `is_loopback` asks for less."""
    with ExitStack() as stack:
        yield _site(work, names, stack, is_loopback=is_loopback)


def _site(work: Path, names: Sequence[str], stack: ExitStack, *, is_loopback: bool) -> Site:
    if not is_loopback and os.geteuid() == 0:
        with contextlib.suppress(NamespacesUnavailable):
            return Lan(work, stack.enter_context(Network()), names)
    return Loopback(names)
