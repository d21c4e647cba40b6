"""The network interfaces of this machine, and which of them other hosts are looked for on.

Source: netdevice(7), getifaddrs(3).
"""

from __future__ import annotations

import fcntl
import ipaddress
import re
import socket
import struct
from collections.abc import Iterable, Sequence
from enum import IntFlag
from pathlib import Path
from typing import TypeAlias

import ifaddr

from nondum.sdk.frozen import frozen

IPInterface: TypeAlias = ipaddress.IPv4Interface | ipaddress.IPv6Interface
"""An address with its network."""

_SIOCGIFFLAGS = 0x8913
_MEMBERSHIPS = Path("/proc/sys/net/ipv4/igmp_max_memberships")
_VIRTUAL = re.compile(r"(docker|br-|veth|virbr|vnet|podman|cni|flannel|cali|lxc|lxd|incus|zt).*")
"""Bridges and virtual cables inside this machine: no other host is behind them, and joining them
all floods a machine that runs containers."""


class Flags(IntFlag):
    """What the kernel says of an interface (`IFF_…`, those that matter here)."""

    UP = 0x1
    """Switched on."""
    LOOPBACK = 0x8
    RUNNING = 0x40
    """There is a link: a cable that is plugged in, a wireless network that was joined."""
    MULTICAST = 0x1000


@frozen
class Interface:
    """One interface, at one moment."""

    name: str
    index: int
    flags: Flags
    addresses: tuple[IPInterface, ...] = ()

    @property
    def is_virtual(self) -> bool:
        """Whether it leads to containers or virtual machines only, to tell by its name.

        >>> Interface("docker0", 3, Flags.UP).is_virtual, Interface("eth0", 2, Flags.UP).is_virtual
        (True, False)
        """
        return _VIRTUAL.fullmatch(self.name) is not None

    @property
    def hosts(self) -> tuple[str, ...]:
        """Its addresses without networks: IPv4 first, then those of the link alone."""
        return tuple(str(one.ip).partition("%")[0] for one in sorted(self.addresses, key=_rank))


def read() -> tuple[Interface, ...]:
    """All interfaces there are now, ordered by index."""
    found = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        for adapter in ifaddr.get_adapters(include_unconfigured=True):
            if adapter.index is None:
                continue
            addresses = tuple(_address(one) for one in adapter.ips)
            flags = _flags(sock, adapter.nice_name)
            found.append(Interface(adapter.nice_name, adapter.index, flags, addresses))
    return tuple(sorted(found, key=lambda one: one.index))


def looked_on(interfaces: Iterable[Interface]) -> tuple[Interface, ...]:
    """Those that other hosts are looked for on: real ones; else virtual ones; else this machine.

    >>> eth, lo = Flags.UP | Flags.MULTICAST, Flags.UP | Flags.LOOPBACK
    >>> here = ipaddress.ip_interface("10.0.0.2/24")
    >>> every = [Interface("lo", 1, lo, (here,)), Interface("docker0", 2, eth, (here,))]
    >>> [one.name for one in looked_on(every)]
    ['docker0']
    """
    usable = [one for one in interfaces if Flags.UP in one.flags and one.addresses]
    outward = [one for one in usable if Flags.MULTICAST in one.flags and not _is_loop(one)]
    real = [one for one in outward if not one.is_virtual]
    return tuple(real or outward or loopback(usable))


def loopback(interfaces: Iterable[Interface]) -> tuple[Interface, ...]:
    """Those that lead to this machine only."""
    return tuple(one for one in interfaces if _is_loop(one) and Flags.UP in one.flags)


def has_ipv6() -> bool:
    """Whether the kernel speaks IPv6 at all."""
    if not socket.has_ipv6:
        return False
    try:
        socket.socket(socket.AF_INET6, socket.SOCK_DGRAM).close()
    except OSError:
        return False
    return True


def memberships() -> int | None:
    """On how many interfaces one socket may listen to multicast; None where that has no limit."""
    try:
        return int(_MEMBERSHIPS.read_text())
    except (OSError, ValueError):
        return None


def of_host(host: str, interfaces: Sequence[Interface]) -> str:
    """The name of the interface whose network an address is on; empty when there is none."""
    address = ipaddress.ip_address(host)
    scope = getattr(address, "scope_id", None)
    if scope is not None:
        return str(scope)
    for one in interfaces:
        if any(address in own.network for own in one.addresses if own.version == address.version):
            return one.name
    return ""


def _is_loop(interface: Interface) -> bool:
    return Flags.LOOPBACK in interface.flags


def _rank(address: IPInterface) -> tuple[bool, bool, str]:
    return address.version == 6, not address.is_link_local, str(address)


def _address(found: ifaddr.IP) -> IPInterface:
    if isinstance(found.ip, str):
        return ipaddress.ip_interface(f"{found.ip}/{found.network_prefix}")
    # The scope is the interface's own.
    return ipaddress.ip_interface(f"{found.ip[0].partition('%')[0]}/{found.network_prefix}")


def _flags(sock: socket.socket, name: str) -> Flags:
    request = struct.pack("16sH14x", name.encode(), 0)
    try:
        answer = fcntl.ioctl(sock, _SIOCGIFFLAGS, request)
    except OSError:  # it has gone since
        return Flags(0)
    return Flags(struct.unpack_from("16xH", answer)[0]) & sum(Flags)
