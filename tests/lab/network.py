"""A network for machines: a bridge with a tap for each, in a namespace made for the scenario.

Nothing of it reaches the outside, and nothing of the outside reaches it. Namespaces carry the
number of the process that made them: what a killed run has left goes when the next one is made.
"""

from __future__ import annotations

import subprocess
from dataclasses import dataclass

from demo.namespaces import Network, Switch

MAC = "52:54:00:4c:41:{number:02x}"
"""Locally administered, QEMU's own prefix."""
ADDRESS = "10.78.0.{number}"
PREFIX = 24
FIND = "grep -l {mac} /sys/class/net/*/address | cut -d/ -f5"


@dataclass(frozen=True, slots=True)
class Socket:
    """Where one machine is plugged in."""

    switch: Switch
    number: int

    @property
    def tap(self) -> str:
        """The network's end of its cable."""
        return f"tap{self.number}"

    @property
    def address(self) -> str:
        """The machine's IPv4 address."""
        return ADDRESS.format(number=self.number)

    @property
    def mac(self) -> str:
        """The address of its network card."""
        return MAC.format(number=self.number)

    @property
    def around(self) -> tuple[str, ...]:
        """What runs a command where the network is."""
        return ("ip", "netns", "exec", self.switch.namespace)

    @property
    def card(self) -> tuple[str, ...]:
        """A network card, as arguments of QEMU."""
        tap = f"tap,id=lan,ifname={self.tap},script=no,downscript=no"
        return ("-netdev", tap, "-device", f"virtio-net-pci,netdev=lan,mac={self.mac},romfile=")

    def pull(self) -> None:
        """Pull the cable out at the switch: the machine sees its link up, and no other host."""
        self._link("set", self.tap, "down")

    def put_back(self) -> None:
        """Plug it in again."""
        self._link("set", self.tap, "up")

    def _link(self, *words: str) -> None:
        command = ("ip", "-n", self.switch.namespace, "link", *words)
        subprocess.run(command, check=True, capture_output=True, text=True)


class Lan:
    """One network; call `close` when the machines on it are off."""

    def __init__(self) -> None:
        """Make it. Raises `NamespacesUnavailable`."""
        self._network = Network().__enter__()
        self._switch = self._network.switch()
        self._sockets = 0

    def socket(self) -> Socket:
        """A place for one machine more."""
        self._sockets += 1
        socket = Socket(self._switch, self._sockets)
        self._switch.add_tap(socket.tap)
        return socket

    def close(self) -> None:
        """Remove it, and end whatever runs in it."""
        self._network.__exit__(None, None, None)
