"""A host that the integrator has given, to be asked where multicast does not reach. Pure."""

from __future__ import annotations

import re

from nondum.sdk.errors import ConfigRefused, Problem
from nondum.sdk.frozen import frozen

DEFAULT_PORT = 7410
_HOST = re.compile(r"[A-Za-z0-9_]([A-Za-z0-9._-]{0,252}[A-Za-z0-9])?")
_IPV6 = re.compile(r"[0-9A-Fa-f:.]{2,45}(%[A-Za-z0-9_.-]{1,15})?")


@frozen
class StaticHost:
    """A name or an address, and a UDP port."""

    host: str
    port: int = DEFAULT_PORT

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @classmethod
    def parse(cls, text: str) -> StaticHost:
        """Read `HOST` or `HOST:PORT`. Raises `ConfigRefused` (STATIC_HOST).

        >>> str(StaticHost.parse("lab-3.local")), str(StaticHost.parse("[fe80::1%eth0]:7500"))
        ('lab-3.local:7410', '[fe80::1%eth0]:7500')
        """
        host, port = text, str(DEFAULT_PORT)
        if bracketed := re.fullmatch(r"\[([^]]*)\](?::(\d+))?", text):
            host, port = bracketed[1], bracketed[2] or port
        elif text.count(":") == 1:
            host, _, port = text.partition(":")
        pattern = _IPV6 if ":" in host else _HOST
        is_port = re.fullmatch(r"[0-9]{1,5}", port) and 0 < int(port) < 65_536
        if not pattern.fullmatch(host) or not is_port:
            raise ConfigRefused(
                Problem(
                    "STATIC_HOST",
                    "it is no host: expected HOST or HOST:PORT",
                    where="peers.static",
                    have=text[:80],
                    fix="write for example `lab-3.local` or `10.0.0.7:7410`",
                )
            )
        return cls(host, int(port))
