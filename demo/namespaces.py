"""Several machines and the networks between them, on one machine: network namespaces of Linux.

Nothing of the machine's own network is touched: every switch is a bridge in a namespace of its
own, every cable a veth pair from there to the namespace of a machine. Needs root, and no kernel
module beyond bridge and veth.

    with Network() as network:
        lan = network.switch()
        rover = network.machine("rover")
        cable = network.plug(rover, lan)  # as 10.77.0.1
        rover.run("hostname")
        cable.pull()
"""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

ROOT = Path(__file__).parent.parent
PREFIX = "nondum"
_NUMBERS = itertools.count(1)
"""One process may have several networks, with machines of the same name."""
"""Namespaces are called `nondum-PID-NAME`, so that those of a process that was killed are known."""
NEVER = ("pfifo", "limit", "0")
"""A queue that takes nothing: what is sent is lost. (netem is not in every kernel.)"""


class NamespacesUnavailable(Exception):
    """This machine or user may not make network namespaces."""


class Process(Protocol):
    """What runs on a machine, and ends with it."""

    def communicate(self) -> tuple[Any, Any]:
        """What else it writes to its output and its errors, once it has ended."""


@dataclass
class Machine:
    """One machine: processes that run there see its network only."""

    name: str
    namespace: str
    processes: list[Process] = field(default_factory=list)
    cables: list[Cable] = field(default_factory=list)

    def command(self, *words: str) -> list[str]:
        """What runs a command there."""
        return ["ip", "netns", "exec", self.namespace, *words]

    def run(self, *words: str) -> str:
        """Run a command there to its end; what it printed. Raises `CalledProcessError`."""
        return _run(*self.command(*words))

    def start(self, *words: str, **options: Any) -> subprocess.Popen[Any]:
        """Start a command there; it is killed with the network. `options` are `Popen`'s."""
        process = subprocess.Popen(self.command(*words), **options)
        self.processes.append(process)
        return process

    def python(self, module: str, *arguments: str, **options: Any) -> subprocess.Popen[Any]:
        """Start a module of this checkout there, with this Python."""
        options = {"cwd": ROOT, **options}
        return self.start(sys.executable, "-m", module, *arguments, **options)

    def ip(self, *words: str) -> str:
        """Run `ip` on its network."""
        return _run("ip", "-n", self.namespace, *words)

    def set(self, key: str, value: str | int) -> None:
        """Set one of its kernel's parameters: `net.ipv6.conf.lan0.accept_dad`."""
        self.run("sysctl", "-qw", f"{key}={value}")


@dataclass
class Switch:
    """One network: the machines that are plugged in there reach each other."""

    number: int
    namespace: str
    cables: list[Cable] = field(default_factory=list)

    def add_tap(self, name: str) -> None:
        """Make a port for a program that stands for a machine, such as an emulator."""
        _run("ip", "-n", self.namespace, "tuntap", "add", "dev", name, "mode", "tap")
        _run("ip", "-n", self.namespace, "link", "set", name, "master", _HALF, "up")

    def split(self, apart: Sequence[Cable]) -> None:
        """Part the network in two: no machine sees its link go down."""
        for cable in apart:
            _run("ip", "-n", self.namespace, "link", "set", cable.port, "master", _OTHER_HALF)

    def join(self) -> None:
        """Make it one again."""
        for cable in self.cables:
            _run("ip", "-n", self.namespace, "link", "set", cable.port, "master", _HALF)


_HALF, _OTHER_HALF = "half0", "half1"


@dataclass(frozen=True)
class Cable:
    """From a machine to a switch."""

    machine: Machine
    switch: Switch
    interface: str
    """Its end in the machine: `lan0`, `lan1`, …"""
    port: str
    """Its end in the switch."""
    address: str
    """IPv4; empty for none."""

    def pull(self) -> None:
        """Pull it out: the machine's link is gone, its addresses stay."""
        self._port("set", self.port, "down")

    def put_back(self) -> None:
        """Plug it in again."""
        self._port("set", self.port, "up")

    def lose_sent(self) -> None:
        """Lose whatever the machine sends, without a word."""
        _run("tc", "-n", self.machine.namespace, *_queue("replace", self.interface), *NEVER)

    def lose_received(self) -> None:
        """Lose whatever is sent to the machine, without a word."""
        _run("tc", "-n", self.switch.namespace, *_queue("replace", self.port), *NEVER)

    def heal(self) -> None:
        """Lose nothing any more."""
        ends = ((self.machine.namespace, self.interface), (self.switch.namespace, self.port))
        for namespace, interface in ends:
            with contextlib.suppress(subprocess.CalledProcessError):  # it lost nothing
                _run("tc", "-n", namespace, *_queue("del", interface))

    def without_multicast(self) -> None:
        """Let no multicast through to the machine, as many switches and all routers do."""
        _run("bridge", "-n", self.switch.namespace, "link", "set", "dev", self.port, *_UNICAST)

    def give(self, address: str) -> None:
        """Give the machine's end an address with its network: `10.77.0.9/24`."""
        self.machine.ip("address", "add", address, "dev", self.interface)

    def take(self, address: str) -> None:
        """Take an address from the machine's end."""
        self.machine.ip("address", "del", address, "dev", self.interface)

    def link_local(self) -> str:
        """The IPv6 address of the link, without scope; empty while there is none."""
        words = ("-6", "-o", "address", "show", "dev", self.interface, "scope", "link")
        found = self.machine.ip(*words).split()
        return found[found.index("inet6") + 1].partition("/")[0] if "inet6" in found else ""

    def _port(self, *words: str) -> None:
        _run("ip", "-n", self.switch.namespace, "link", *words)


_UNICAST = ("mcast_flood", "off")


class Network:
    """Machines and switches, from the begin to the end of a `with` block."""

    def __init__(self) -> None:
        self.machines: list[Machine] = []
        self.switches: list[Switch] = []

    def __enter__(self) -> Network:
        """Remove first what killed processes have left. Raises `NamespacesUnavailable`."""
        for namespace in _namespaces():
            owner = _owner(namespace)
            if owner is not None and not Path(f"/proc/{owner}").exists():
                with contextlib.suppress(subprocess.CalledProcessError):  # another removes it, too
                    _remove(namespace)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Kill what runs there, and remove it all."""
        for machine in self.machines:
            _remove(machine.namespace)  # first, or a grandchild may keep a pipe open
            for process in machine.processes:
                process.communicate()
        for switch in self.switches:
            _remove(switch.namespace)

    def switch(self) -> Switch:
        """A network more: the first is 10.77.0.0/24, the second 10.77.1.0/24, …"""
        made = Switch(len(self.switches), _add(f"switch{len(self.switches)}"))
        self.switches.append(made)
        for half in (_HALF, _OTHER_HALF):
            _run("ip", "-n", made.namespace, "link", "add", half, "type", "bridge")
            _run("ip", "-n", made.namespace, "link", "set", half, "up")
        return made

    def machine(self, name: str) -> Machine:
        """A machine more, with nothing plugged in."""
        made = Machine(name, _add(name))
        self.machines.append(made)
        made.ip("link", "set", "lo", "up")
        # Addresses of the link are ready at once instead of after two seconds.
        made.set("net.ipv6.conf.default.accept_dad", 0)
        return made

    def plug(
        self, machine: Machine, switch: Switch, *, ipv4: str | None = None, ipv6: bool = True
    ) -> Cable:
        """Join a machine to a switch; an empty `ipv4` leaves it without an address."""
        interface, port = f"lan{len(machine.cables)}", f"port{len(switch.cables)}"
        address = f"10.77.{switch.number}.{len(switch.cables) + 1}" if ipv4 is None else ipv4
        cable = Cable(machine, switch, interface, port, address)
        far = ("netns", machine.namespace)
        add = ("link", "add", port, "type", "veth", "peer", "name", interface, *far)
        _run("ip", "-n", switch.namespace, *add)
        _run("ip", "-n", switch.namespace, "link", "set", port, "master", _HALF, "up")
        if not ipv6:
            machine.set(f"net.ipv6.conf.{interface}.disable_ipv6", 1)
        if address:
            cable.give(f"{address}/24")
        machine.ip("link", "set", interface, "up")
        machine.cables.append(cable)
        switch.cables.append(cable)
        return cable

    def lan(self, *names: str) -> tuple[Machine, ...]:
        """Machines of these names, all on one new switch."""
        switch = self.switch()
        machines = tuple(self.machine(name) for name in names)
        for machine in machines:
            self.plug(machine, switch)
        return machines


def _namespaces() -> Iterator[str]:
    try:
        lines = _run("ip", "netns", "list").splitlines()
    except (OSError, subprocess.CalledProcessError) as error:
        raise NamespacesUnavailable(str(error)) from error
    return (line.split()[0] for line in lines if line)


def _owner(namespace: str) -> int | None:
    """The process that made a namespace; None for one of other programs.

    >>> _owner("nondum-4711-1-rover"), _owner("vpn")
    (4711, None)
    """
    match namespace.split("-", 2):
        case [prefix, pid, _] if prefix == PREFIX and pid.isdigit():
            return int(pid)
    return None


def _add(name: str) -> str:
    namespace = f"{PREFIX}-{os.getpid()}-{next(_NUMBERS)}-{name}"
    try:
        _run("ip", "netns", "add", namespace)
    except (OSError, subprocess.CalledProcessError) as error:
        raise NamespacesUnavailable(f"{error}: {getattr(error, 'stderr', '')}") from error
    return namespace


def _remove(namespace: str) -> None:
    while pids := _run("ip", "netns", "pids", namespace).split():
        for pid in pids:
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(pid), signal.SIGKILL)
    _run("ip", "netns", "delete", namespace)


def _queue(verb: str, interface: str) -> tuple[str, ...]:
    return ("qdisc", verb, "dev", interface, "root")


def _run(*words: str) -> str:
    found = subprocess.run(words, check=True, capture_output=True, text=True)
    return found.stdout
