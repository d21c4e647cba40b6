"""Stands in for a worker of level 2 among the daemon's children: it has the warden start a service
when orders come, hands the orders on, and ends as the service ends.

Run as `python -I -m nondum.host.confinement.systemd_stand_in ORDERS HOST`, like an interpreter that
waits to become a worker (`nondum.host.inside.bootstrap`).
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from nondum.host.confinement.systemd import Request
from nondum.host.confinement.systemd_warden import ORPHANED, TERM
from nondum.host.inside import kernel

SOCKET = Path("/run/nondum-warden/warden.sock")
ORDER_BYTES = 128 * 1024
ANSWER_BYTES = 4096
EXITED = "1"
"""CLD_EXITED: of the codes of sigaction(2), as ExecMainCode has them."""


def main(orders: int, host_pid: int) -> None:
    """Wait for orders, then for the end; does not return."""
    kernel.end_with(host_pid, signal.SIGKILL)
    with socket.socket(fileno=orders) as waiting:
        order, descriptors, _, _ = socket.recv_fds(waiting, ORDER_BYTES, 1)
    if not order:
        raise SystemExit(0)  # not needed
    asked = request(json.loads(order))
    warden = _warden(asked)
    signal.signal(signal.SIGTERM, lambda *_: _tell(warden, TERM))
    signal.signal(signal.SIGUSR1, lambda *_: _leave(warden))
    kernel.end_with(host_pid, signal.SIGUSR1)
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours, theirs:
        socket.send_fds(warden, [asked.encode()], [theirs.fileno(), 1, 2])
        socket.send_fds(ours, [order], descriptors)
    for descriptor in (*descriptors, 1, 2):  # the service has them; ours must not keep them open
        os.close(descriptor)
    end_like(json.loads(warden.recv(ANSWER_BYTES) or b"{}"))


def request(order: Mapping[str, Any]) -> Request:
    """What an order to an interpreter asks of the warden."""
    limits, service = order["limits"], order["walls"]["service"]
    return Request(
        component=order["component"],
        code=tuple(order["site_packages"]),
        scratch=order["scratch"],
        permissions=tuple(service["permissions"]),
        has_devices=service["has_devices"],
        memory_mb=limits["memory_mb"],
        tasks=limits["tasks"],
        descriptors=limits["descriptors"],
        scratch_mb=limits["scratch_mb"],
        cpu_weight=service["cpu_weight"],
        processors=float(limits["processors"]),
    )


def end_like(ended: Mapping[str, str]) -> None:
    """End as the service did; does not return."""
    status = int(ended.get("ExecMainStatus", "1"))
    if ended.get("ExecMainCode", EXITED) != EXITED:
        signal.signal(status, signal.SIG_DFL) if status != signal.SIGKILL else None
        os.kill(os.getpid(), status)
    os._exit(status)


def _warden(asked: Request) -> socket.socket:
    """A connection to one. Raises `OSError`."""
    if os.getuid() == 0:
        return _own_warden(asked)
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    connection.connect(str(SOCKET))
    return connection


def _own_warden(asked: Request) -> socket.socket:
    """Root's own, out of reach of what ends this process."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    folders = {str(Path(folder).parent) for folder in asked.code}
    places = [part for folder in sorted(folders) for part in ("--place", folder)]
    words = [sys.executable, "-I", "-m", "nondum.host.confinement.systemd_warden", *places]
    with theirs:
        subprocess.Popen(
            words, stdin=theirs.fileno(), stdout=subprocess.DEVNULL, start_new_session=True
        )
    return ours


def _leave(warden: socket.socket) -> None:
    """The daemon is gone."""
    _tell(warden, ORPHANED)
    os._exit(0)


def _tell(warden: socket.socket, word: bytes) -> None:
    with contextlib.suppress(OSError):
        warden.send(word)


def start_command(orders: int) -> Sequence[str]:
    """How one is started, by its daemon."""
    words = (sys.executable, "-I", "-m", "nondum.host.confinement.systemd_stand_in")
    return (*words, str(orders), str(os.getpid()))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
