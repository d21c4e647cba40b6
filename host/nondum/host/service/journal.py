"""The daemon's log as structured entries of systemd's journal, where its standard error is that.

The protocol: https://systemd.io/JOURNAL_NATIVE_PROTOCOL/. What stands in the fields is documented
in docs/service.md.
"""

from __future__ import annotations

import logging
import os
import re
import socket
import struct
import sys
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from nondum.sdk.errors import NondumError, Problem

SOCKET = "/run/systemd/journal/socket"
LONGEST_VALUE = 32_768
"""Bytes of a value: an entry goes as one datagram, of which the kernel takes some 200 kB."""
PREFIX = "NONDUM_"

_PRIORITIES = (
    (logging.CRITICAL, 2),
    (logging.ERROR, 3),
    (logging.WARNING, 4),
    (logging.INFO, 6),
    (logging.DEBUG, 7),
)
_NAME = re.compile(r"[A-Z][A-Z0-9_]{0,63}")

Fields = Iterable[tuple[str, str]]


def encode(fields: Fields) -> bytes:
    r"""The datagram of one entry; a name may come more than once.

    >>> encode([("PRIORITY", "6"), ("MESSAGE", "one\ntwo")])
    b'PRIORITY=6\nMESSAGE\n\x07\x00\x00\x00\x00\x00\x00\x00one\ntwo\n'
    """
    return b"".join(_field(name, value) for name, value in fields)


def _field(name: str, value: str) -> bytes:
    assert _NAME.fullmatch(name), f"{name!r} is no name of a field"
    data = value.encode("utf-8", "replace")[:LONGEST_VALUE]
    if b"\n" in data:
        return b"%s\n%s%s\n" % (name.encode(), struct.pack("<Q", len(data)), data)
    return b"%s=%s\n" % (name.encode(), data)


def is_in_use(environment: Mapping[str, str] = os.environ, fd: int = 2) -> bool:
    """Whether what is written to a descriptor goes to the journal: see JOURNAL_STREAM in
    systemd.exec(5)."""
    try:
        found = os.fstat(fd)
    except OSError:
        return False
    return environment.get("JOURNAL_STREAM") == f"{found.st_dev}:{found.st_ino}"


class JournalHandler(logging.Handler):
    """Sends each record as one entry. What the journal does not take goes to standard error."""

    def __init__(self, address: str = SOCKET) -> None:
        super().__init__()
        self._address = address
        self._socket = socket.socket(
            socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC | socket.SOCK_NONBLOCK
        )
        self._lost = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Send it. Never waits: while the journal is not read, entries are lost and counted."""
        try:
            lost = [("NONDUM_LOST", str(self._lost))] if self._lost else []
            self._socket.sendto(encode([*self._fields(record), *lost]), self._address)
        except BlockingIOError:
            self._lost += 1
        except OSError:
            sys.stderr.write(f"{record.getMessage()}\n")
        except Exception:
            self.handleError(record)
        else:
            self._lost = 0

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
        super().close()

    def _fields(self, record: logging.LogRecord) -> Iterator[tuple[str, str]]:
        yield "MESSAGE", self.format(record)
        yield "PRIORITY", str(next((p for level, p in _PRIORITIES if record.levelno >= level), 7))
        yield "SYSLOG_IDENTIFIER", "nondum"
        yield "NONDUM_LOGGER", record.name
        yield "CODE_FILE", record.pathname
        yield "CODE_LINE", str(record.lineno)
        yield "CODE_FUNC", record.funcName or ""
        told: Fields = getattr(record, "journal", ())
        yield from told
        if not told:
            yield from (("NONDUM_CODE", code) for code in dict.fromkeys(_codes(record.args)))


def _codes(arguments: Any) -> Iterator[str]:
    """The codes of problems that a record tells of."""
    for value in arguments if isinstance(arguments, tuple) else ():
        match value:
            case Problem():
                yield value.code
            case NondumError():
                yield from (problem.code for problem in value.problems)
