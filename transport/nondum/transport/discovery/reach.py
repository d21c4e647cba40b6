"""Which of the addresses that a stranger has named are worth a try. Pure.

Any host may announce any address, and every host that receives it dials: an announcement must not
make hosts dial machines far away, or local services.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable, Sequence

from nondum.transport.discovery.hint import MAX_ADDRESSES, host_of
from nondum.transport.discovery.interfaces import Flags, Interface, of_host


def worth_trying(addresses: Iterable[str], own: Sequence[Interface]) -> tuple[str, ...]:
    """The addresses on a network of this host's, then private ones; 16 at most.

    `own` are the interfaces that hosts are looked for on.

    >>> lan = ipaddress.ip_interface("10.77.0.1/24")
    >>> eth0 = [Interface("eth0", 2, Flags.UP | Flags.MULTICAST, (lan,))]
    >>> named = ["tcp://192.168.1.9:7410", "tcp://10.77.0.9:7410", "tcp://1.1.1.1:7410"]
    >>> worth_trying([*named, "tcp://127.0.0.1:22"], eth0)
    ('tcp://10.77.0.9:7410', 'tcp://192.168.1.9:7410')
    """
    near, far = [], []
    for address in addresses:
        host = host_of(address)
        if _is_nobodys(host, own):
            continue
        if of_host(host, own):
            near.append(address)
        elif ipaddress.ip_address(host).is_private:
            far.append(address)
    return tuple((near + far)[:MAX_ADDRESSES])


def _is_nobodys(host: str, own: Sequence[Interface]) -> bool:
    """Whether no other host can have it, or this host cannot tell which way it is."""
    ip = ipaddress.ip_address(host)
    if isinstance(ip, ipaddress.IPv6Address):
        if ip.ipv4_mapped is not None:
            return True
        if ip.is_link_local and ip.scope_id is None:
            return True
    if ip.is_loopback:
        return not any(Flags.LOOPBACK in one.flags for one in own)
    return ip.is_multicast or ip.is_unspecified or ip.is_reserved
