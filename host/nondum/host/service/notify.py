"""Telling a service manager how the daemon is: what is needed of sd_notify(3)."""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import MutableMapping
from contextlib import suppress

LONGEST_STATUS = 400
"""Characters of a status: people read it as one line."""

_ASKED_BY = ("NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID")

log = logging.getLogger(__name__)


def encode(**fields: str) -> bytes:
    r"""The datagram of some assignments, in their order; a value is one line.

    >>> encode(READY="1", STATUS="3 components\nat work")
    b'READY=1\nSTATUS=3 components at work\n'
    """
    lines = (f"{name}={' '.join(value.split())}\n" for name, value in fields.items())
    return "".join(lines).encode("utf-8", "replace")


class Notifier:
    """Tells the service manager how the daemon is, if one asked for that. `close` it."""

    def __init__(self, address: str = "", watchdog_s: float | None = None) -> None:
        """`address` is a path, or `@` and an abstract name."""
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        self._socket: socket.socket | None = None
        if address:
            self._socket = socket.socket(
                socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC | socket.SOCK_NONBLOCK
            )
        self.watchdog_s = watchdog_s if address else None
        """The longest that it may be silent once it is ready; None: it is not watched."""

    @classmethod
    def from_environment(cls, environment: MutableMapping[str, str]) -> Notifier:
        """What the environment asks for. It is taken out: children are asked for nothing."""
        address, watchdog, pid = (environment.pop(name, "") for name in _ASKED_BY)
        is_watched = watchdog.isdecimal() and int(watchdog) > 0 and pid in ("", str(os.getpid()))
        return cls(address, int(watchdog) / 1e6 if is_watched else None)

    @property
    def is_asked(self) -> bool:
        """Whether anybody wants to be told."""
        return self._socket is not None

    def ready(self) -> None:
        """It serves."""
        self._tell(READY="1")

    def alive(self) -> None:
        """It does its work."""
        self._tell(WATCHDOG="1")

    def status(self, words: str) -> None:
        """What it does, for people."""
        self._tell(STATUS=words[:LONGEST_STATUS])

    def starting(self, more_s: float) -> None:
        """It is still starting, and may take `more_s` seconds more from now on."""
        self._tell(EXTEND_TIMEOUT_USEC=str(round(more_s * 1e6)))

    def stopping(self) -> None:
        """It ends."""
        self._tell(STOPPING="1", STATUS="stopping")

    def close(self) -> None:
        """Tell nothing any more."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _tell(self, **fields: str) -> None:
        """Never waits: a manager that does not listen is no reason for a robot to stop."""
        if self._socket is None:
            return
        with suppress(BlockingIOError):
            try:
                self._socket.sendto(encode(**fields), self._address)
            except BlockingIOError:
                raise
            except OSError as error:
                log.warning("the service manager cannot be told: %s", error)
                self.close()
