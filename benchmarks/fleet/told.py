"""What every kind of host publishes and tells, and what it has taken so far."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import struct
import time
from pathlib import Path
from typing import Any

from benchmarks import measuring

CATALOGUE = {f"component/{number}": {"text": "x" * 970} for number in range(10)}
NEWS = {"component/9": {"text": "y" * 200}}
# struct tcp_info of linux/tcp.h: bytes_sent comes after 200 bytes.
_TCP_INFO = struct.Struct("=200xQ")


def tell(what: dict[str, Any]) -> None:
    """Print it as one line of JSON."""
    print(json.dumps(what), flush=True)


def duplicate(descriptor: int) -> socket.socket:
    """The socket of a descriptor once more. Raises `OSError` where there is none."""
    copy = os.dup(descriptor)
    try:
        return socket.socket(fileno=copy)
    except OSError:
        os.close(copy)
        raise


def bytes_sent() -> int:
    """What has left by all TCP connections that this process has."""
    total = 0
    for name in os.listdir("/proc/self/fd"):  # noqa: PTH208  # numbers, not paths
        with contextlib.suppress(OSError), duplicate(int(name)) as one:  # or none of TCP
            info = one.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _TCP_INFO.size)
            total += int(_TCP_INFO.unpack(info)[0])
    return total


def rss_mb() -> float:
    fields = Path("/proc/self/statm").read_text(encoding="ascii").split()
    return int(fields[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def usage() -> dict[str, Any]:
    return {
        "at_s": time.monotonic(),
        "cpu_s": measuring.cpu_s(),
        "sent": bytes_sent(),
        "rss_mb": rss_mb(),
    }
