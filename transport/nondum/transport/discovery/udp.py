"""UDP sockets that speak both versions of IP where the kernel does."""

from __future__ import annotations

import socket
from typing import Any

from nondum.transport.discovery.interfaces import has_ipv6

ANYWHERE = "*"


def bound(host: str, port: int) -> socket.socket:
    """A socket at an address of this machine, `*` for all of them. Raises `OSError`."""
    if host == ANYWHERE:
        host = "::" if has_ipv6() else "0.0.0.0"
    family, kind, protocol, _, address = socket.getaddrinfo(
        host, port, type=socket.SOCK_DGRAM, flags=socket.AI_NUMERICHOST
    )[0]
    sock = socket.socket(family, kind, protocol)
    try:
        if family == socket.AF_INET6:
            sock.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        sock.bind(address)
    except BaseException:
        sock.close()
        raise
    sock.settimeout(0)
    return sock


def end(family: int, host: str, port: int) -> tuple[Any, ...]:
    """An IP address as sockets of a family take it. Raises `OSError` where they cannot."""
    if family == socket.AF_INET6 and ":" not in host:
        host = f"::ffff:{host}"
    found = socket.getaddrinfo(host, port, family, socket.SOCK_DGRAM, flags=socket.AI_NUMERICHOST)
    return found[0][4]
