"""What the kernel knows of a TCP connection. Source: linux/tcp.h, struct tcp_info."""

from __future__ import annotations

import os
import socket
import struct
from contextlib import closing
from dataclasses import dataclass

# 8 small fields, 24 u32 (the 13th: last_data_recv), 3 u64, bytes_received, 3 u32, min_rtt.
_TCP_INFO = struct.Struct("=52xI72xQ12xI")


@dataclass(frozen=True, slots=True)
class TcpState:
    """One connection, now."""

    quiet_s: float
    """Since any byte came."""
    bytes_received: int
    round_trip_s: float
    """The shortest that was seen."""


def state(descriptor: int) -> TcpState | None:
    """Look at a connection; None when it is gone, or is none."""
    try:
        with closing(socket.socket(fileno=os.dup(descriptor))) as connection:
            info = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _TCP_INFO.size)
    except OSError:
        return None
    if len(info) < _TCP_INFO.size:
        return None
    quiet_ms, received, round_trip_us = _TCP_INFO.unpack(info)
    return TcpState(quiet_ms / 1e3, received, round_trip_us / 1e6)
