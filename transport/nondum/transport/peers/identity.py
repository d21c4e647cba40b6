"""The identity of this host for its peers, and how links are secured."""

from __future__ import annotations

import ipaddress
from enum import Enum

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import HostKeys, PeerKey


class Security(Enum):
    """How links are secured; shown wherever the state of the host is."""

    CURVE = "keys"
    """Every link is encrypted, and both ends have proved their keys."""
    ROUTER = "router: hosts that it lets in are believed without proof of their keys"
    """The link to a router is secured; peers have not proved their keys to each other."""
    DEVELOPMENT = "development: no keys, this machine only"


@frozen
class Identity:
    """A host."""

    name: str
    keys: HostKeys | None
    """None in development mode."""
    certificate: bytes = b""
    """Of the fleet; empty for none."""

    @property
    def security(self) -> Security:
        """How its links are secured."""
        return Security.DEVELOPMENT if self.keys is None else Security.CURVE

    @property
    def key(self) -> PeerKey:
        """What peers know it by; in development mode, made of its name."""
        return PeerKey(f"development:{self.name}") if self.keys is None else self.keys.public

    def check_address(self, address: str) -> None:
        """Refuse addresses beyond this machine in development mode.

        >>> Identity("rover", None).check_address("tcp://127.0.0.1:7000")

        Raises `PeerRefused` (DEVELOPMENT_LOOPBACK, ADDRESS_MALFORMED).
        """
        scheme, _, rest = address.partition("://")
        host, _, port = rest.rpartition(":")
        if scheme != "tcp" or not host or not port:
            raise PeerRefused(
                Problem("ADDRESS_MALFORMED", "an address is tcp://HOST:PORT", have=address)
            )
        if self.keys is None and not is_loopback(host):
            raise PeerRefused(
                Problem(
                    "DEVELOPMENT_LOOPBACK",
                    "without keys, peers may be on this machine only",
                    have=address,
                    fix="use 127.0.0.1, or give the host keys",
                )
            )


def is_loopback(host: str) -> bool:
    """Whether an IP address stays on this machine; a name does not count as one.

    >>> is_loopback("127.0.0.1"), is_loopback("[::1]"), is_loopback("localhost")
    (True, True, False)
    """
    try:
        address = ipaddress.ip_address(host.strip("[]"))
    except ValueError:
        return False
    mapped = getattr(address, "ipv4_mapped", None)
    return (mapped or address).is_loopback
