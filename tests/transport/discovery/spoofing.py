"""Packets of DNS-SD as a stranger makes them: well-formed, and full of lies."""

from __future__ import annotations

import socket
import struct
from collections.abc import Sequence

from nondum.transport.discovery.hint import SERVICE

GROUP = ("224.0.0.251", 5353)
_A, _PTR, _TXT, _SRV = 1, 12, 16, 33


def announced(
    name: str,
    txt: dict[str, str] | bytes,
    addresses: Sequence[str] = (),
    *,
    port: int = 7410,
    ttl: int = 120,
) -> bytes:
    """A response that announces an instance."""
    server = _labels("liar.local.")
    text = txt if isinstance(txt, bytes) else b"".join(_string(f"{k}={txt[k]}") for k in txt)
    records = [
        (SERVICE, _PTR, _labels(name)),
        (name, _SRV, struct.pack("!HHH", 0, 0, port) + server),
        (name, _TXT, text or b"\0"),
        *(("liar.local.", _A, socket.inet_aton(address)) for address in addresses),
    ]
    head = struct.pack("!HHHHHH", 0, 0x8400, 0, len(records), 0, 0)
    return head + b"".join(_record(*record, ttl=ttl) for record in records)


def on_loopback() -> socket.socket:
    """A socket whose multicast goes round on this machine."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
    return sock


def _record(name: str, kind: int, data: bytes, *, ttl: int) -> bytes:
    shared = 0 if kind == _PTR else 0x8000
    return _labels(name) + struct.pack("!HHIH", kind, 1 | shared, ttl, len(data)) + data


def _labels(name: str) -> bytes:
    return b"".join(_string(label) for label in name.rstrip(".").split(".")) + b"\0"


def _string(text: str) -> bytes:
    data = text.encode()
    return bytes([len(data)]) + data
