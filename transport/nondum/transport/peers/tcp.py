"""A TCP connection by its descriptor: what the kernel knows of it, and its end.

ZeroMQ owns the descriptors, and closes them when it wants to. One may then belong to another
connection of this process: the address of the other end tells.

Source: tcp(7) (TCP_INFO, SIOCINQ), struct tcp_info of linux/tcp.h.
"""

from __future__ import annotations

import errno
import fcntl
import os
import socket
import struct
import termios
from contextlib import closing
from typing import Any

from nondum.sdk.frozen import frozen

# 8 small fields, 24 u32 (the 13th: last_data_recv), 3 u64, bytes_received, 3 u32, min_rtt.
_TCP_INFO = struct.Struct("=52xI72xQ12xI")
_COUNT = struct.Struct("=i")


@frozen
class TcpState:
    """One connection, now."""

    quiet_s: float
    """Since any byte came."""
    bytes_received: int
    bytes_read: int
    """Those of the received that this process has read."""
    round_trip_s: float
    """The shortest that was seen."""


def state(descriptor: int, end: str = "") -> TcpState | None:
    """Look at a connection; None when it is gone, is none, or leads to another end than `end`."""
    try:
        with closing(_duplicate(descriptor)) as connection:
            if end and written(connection.getpeername()) != end:
                return None
            info = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _TCP_INFO.size)
            # After the bytes that came, or what comes in between would count as read.
            (unread,) = _COUNT.unpack(fcntl.ioctl(connection, termios.FIONREAD, bytes(4)))
    except (OSError, ValueError):
        return None
    if len(info) < _TCP_INFO.size:
        return None
    quiet_ms, received, round_trip_us = _TCP_INFO.unpack(info)
    return TcpState(quiet_ms / 1e3, received, max(0, received - unread), round_trip_us / 1e6)


def other_end(descriptor: int) -> str:
    """The other end of a connection as `written`; empty when there is none."""
    try:
        with closing(_duplicate(descriptor)) as connection:
            return written(connection.getpeername())
    except (OSError, ValueError):
        return ""


def written(end: tuple[Any, ...]) -> str:
    """An end of a TCP connection as ZeroMQ takes it, behind `tcp://`.

    >>> written(("::ffff:10.0.0.7", 50001, 0, 0)), written(("fe80::1", 50001, 0, 3))
    ('10.0.0.7:50001', '[fe80::1%3]:50001')
    """
    host, port, *more = end
    if "." in host:  # an IPv4 address, or one that is mapped into IPv6 (RFC 4291, 2.5.5.2)
        return f"{host.removeprefix('::ffff:')}:{port}"
    scope = more[1] if len(more) > 1 else 0
    return f"[{host}%{scope}]:{port}" if scope else f"[{host}]:{port}"


def cut(descriptor: int, end: str) -> None:
    """Shut a connection down, if the descriptor is still the one to that end."""
    try:
        with closing(_duplicate(descriptor)) as connection:
            if written(connection.getpeername()) == end:
                connection.shutdown(socket.SHUT_RDWR)
    except (OSError, ValueError):
        return  # it is gone by itself


def _duplicate(descriptor: int) -> socket.socket:
    """The same connection under another descriptor, which ZeroMQ does not close.

    Raises `OSError` for one that is no Internet socket's any more.
    """
    copy = os.dup(descriptor)
    try:
        connection = socket.socket(fileno=copy)
    except OSError:
        os.close(copy)
        raise
    if connection.family not in (socket.AF_INET, socket.AF_INET6):
        connection.close()
        raise OSError(errno.ENOTCONN, "the descriptor is another kind of socket's")
    return connection
