"""The public announcement of a host. It proves nothing: receivers treat it as a hint only."""

from __future__ import annotations

import ipaddress

from nondum.sdk.frozen import frozen
from nondum.transport.peers.identity import Security, is_loopback
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.messages import VERSIONS

DEVELOPMENT = "development:"
"""What the key of a host without keys begins with."""


@frozen
class Announcement:
    """One host, for as long as nothing of this changes."""

    key: PeerKey
    name: str
    epoch: int
    listening: tuple[str, ...]
    """Where it listens, as `PeerNode.start` tells: `tcp://HOST:PORT`, `[::]` and `0.0.0.0` for
    every interface. Those with another port than the first are not announced."""
    pairing_port: int | None = None
    """Where it listens for pairing, while it does."""
    versions: tuple[int, ...] = VERSIONS
    """Of the protocol that peers speak."""

    @property
    def security(self) -> Security:
        """How its links are secured; hosts of another kind are of no use to it."""
        return security_of(self.key)

    @property
    def port(self) -> int:
        """Where peers dial, and where it answers those who ask by UDP."""
        return int(self.listening[0].rpartition(":")[2])

    @property
    def hosts(self) -> tuple[str, ...]:
        """The addresses it listens at, without brackets."""
        ends = (address.removeprefix("tcp://").rpartition(":") for address in self.listening)
        here = (host.strip("[]") for host, _, port in ends if int(port) == self.port)
        return tuple(host.removeprefix("::ffff:") for host in here)  # as ZeroMQ writes IPv4

    @property
    def is_everywhere(self) -> bool:
        """Whether it listens on every interface."""
        return any(host == "*" or _is_unspecified(host) for host in self.hosts)

    @property
    def is_on_this_machine_only(self) -> bool:
        """Whether it listens on loopback addresses only."""
        return all(is_loopback(host) for host in self.hosts)


def security_of(key: str) -> Security:
    """How links to the owner of a key are secured.

    >>> security_of("development:rover")
    <Security.DEVELOPMENT: 'development: no keys, this machine only'>
    """
    return Security.DEVELOPMENT if key.startswith(DEVELOPMENT) else Security.CURVE


def _is_unspecified(host: str) -> bool:
    try:
        return ipaddress.ip_address(host.partition("%")[0]).is_unspecified
    except ValueError:
        return False
