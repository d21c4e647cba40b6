"""Tells when an interface or an address of this machine has come, gone or changed.

Source: rtnetlink(7). Where there is no netlink, the interfaces are read every few seconds.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable

_GROUPS = 0x1 | 0x10 | 0x100  # RTMGRP_LINK, RTMGRP_IPV4_IFADDR, RTMGRP_IPV6_IFADDR
SETTLE_S = 0.02
"""Changes come in bursts; they are told once."""
POLL_S = 3.0


class InterfaceWatch:
    """Watches from `start` to `close`."""

    def __init__(self, on_change: Callable[[], None]) -> None:
        """`on_change` may be called without a change that matters."""
        self._on_change = on_change
        self._loop = asyncio.get_running_loop()
        self._socket: socket.socket | None = None
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Begin to watch."""
        try:
            self._socket = _netlink()
        except (AttributeError, OSError):  # another system than Linux, or a sandbox
            self._poll()
        else:
            self._loop.add_reader(self._socket, self._drain)

    def close(self) -> None:
        """Watch no more."""
        if self._timer is not None:
            self._timer.cancel()
        if self._socket is not None:
            self._loop.remove_reader(self._socket)
            self._socket.close()

    def _drain(self) -> None:
        assert self._socket is not None
        # What changed is not read: the interfaces are, so that a lost message (ENOBUFS) is none.
        with contextlib.suppress(OSError):
            while self._socket.recv(65_536):
                pass
        if self._timer is None:
            self._timer = self._loop.call_later(SETTLE_S, self._tell)

    def _tell(self) -> None:
        self._timer = None
        self._on_change()

    def _poll(self) -> None:
        self._timer = self._loop.call_later(POLL_S, self._poll)
        self._on_change()


def _netlink() -> socket.socket:
    kind = socket.SOCK_RAW | socket.SOCK_NONBLOCK | socket.SOCK_CLOEXEC
    sock = socket.socket(socket.AF_NETLINK, kind, socket.NETLINK_ROUTE)
    try:
        sock.bind((0, _GROUPS))
    except BaseException:
        sock.close()
        raise
    return sock
