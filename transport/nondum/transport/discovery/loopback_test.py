"""Whether what is sent to the group of multicast DNS comes back. Source: RFC 6762."""

from __future__ import annotations

import secrets
import socket
import struct
import time

from nondum.sdk.frozen import frozen
from nondum.transport.discovery.hint import SERVICE

PORT = 5353
PATIENCE_S = 0.5


@frozen
class LoopbackTest:
    """A multicast group, on one interface."""

    group: str
    way: bytes
    """The interface, as sockets of the group's family take it."""

    @property
    def check(self) -> str:
        """What looking at it is called."""
        return "IPv6 multicast" if ":" in self.group else "IPv4 multicast"

    def has_echo(self) -> bool:
        """Whether a question, sent as any host sends it, comes back. Raises `OSError`."""
        question = _question()
        with self._receiver() as receiver:
            self._say(question)
            return _comes(receiver, question)

    def _receiver(self) -> socket.socket:
        family, level, join = (
            (socket.AF_INET6, socket.IPPROTO_IPV6, socket.IPV6_JOIN_GROUP)
            if ":" in self.group
            else (socket.AF_INET, socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP)
        )
        sock = socket.socket(family, socket.SOCK_DGRAM)
        try:
            for option in (socket.SO_REUSEADDR, socket.SO_REUSEPORT):
                sock.setsockopt(socket.SOL_SOCKET, option, 1)
            sock.bind(("", PORT))
            sock.setsockopt(level, join, socket.inet_pton(family, self.group) + self.way)
        except BaseException:
            sock.close()
            raise
        return sock

    def _say(self, data: bytes) -> None:
        family, level, via = (
            (socket.AF_INET6, socket.IPPROTO_IPV6, socket.IPV6_MULTICAST_IF)
            if ":" in self.group
            else (socket.AF_INET, socket.IPPROTO_IP, socket.IP_MULTICAST_IF)
        )
        with socket.socket(family, socket.SOCK_DGRAM) as sock:
            sock.setsockopt(level, via, self.way)
            sock.sendto(data, (self.group, PORT))


def _comes(receiver: socket.socket, wanted: bytes) -> bool:
    until_s = time.monotonic() + PATIENCE_S
    while (left_s := until_s - time.monotonic()) > 0:
        receiver.settimeout(left_s)
        try:
            if receiver.recv(9000) == wanted:
                return True
        except TimeoutError:
            return False
    return False


def _question() -> bytes:
    """Who is there? The random id makes it this one (RFC 6762, section 18.1)."""
    labels = b"".join(bytes([len(x)]) + x.encode() for x in SERVICE.rstrip(".").split("."))
    head = secrets.token_bytes(2) + struct.pack("!HHHHH", 0, 1, 0, 0, 0)
    return head + labels + b"\0" + struct.pack("!HH", 12, 1)
