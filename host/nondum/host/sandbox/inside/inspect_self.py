"""Looks around in a worker's place, so that the host knows what its confinement is worth."""

from __future__ import annotations

import json
import os
import socket
from pathlib import Path

from nondum.host.sandbox.inside import kernel


def main(link: int) -> None:
    """Tell over the link, as one JSON object, what is to be seen; does not return."""
    with socket.socket(fileno=link) as host:
        host.send(json.dumps(around()).encode())
    os._exit(0)


def around() -> dict[str, object]:
    """What a worker can see and do here."""
    status = dict(
        line.split(":\t", 1)
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        if ":\t" in line
    )
    return {
        "capabilities": int(status["CapEff"], 16) | int(status["CapPrm"], 16),
        "no_new_privileges": status.get("NoNewPrivs") == "1",
        "filters": status.get("Seccomp") == "2",
        "processes": sum(entry.isdigit() for entry in os.listdir("/proc")),  # noqa: PTH208
        "interfaces": sorted(name for _, name in socket.if_nameindex()) if _has_network() else [],
        "sees_state": _can_list("/var/cache") or _can_list("/var/log"),
        "sees_library": _can_list(os.path.dirname(os.__file__)),  # noqa: PTH120
        "writes_system": _can_write("/") or _can_write("/usr"),
        "makes_namespaces": kernel.LIBC.unshare(kernel.CLONE_NEWUSER) == 0,
        "signals_host": _can_signal(),
        "user": _user_outside(),
    }


def _user_outside() -> int:
    """Which user it is one namespace further out (user_namespaces(7)), where it is one only."""
    _, outside, _ = Path("/proc/self/uid_map").read_text(encoding="ascii").split()[:3]
    return int(outside)


def _has_network() -> bool:
    try:
        socket.socket(socket.AF_INET).close()
    except OSError:
        return False
    return True


def _can_list(folder: str) -> bool:
    try:
        os.listdir(folder)  # noqa: PTH208
    except OSError:
        return False
    return True


def _can_write(folder: str) -> bool:
    probe = os.path.join(folder, f".nondum-{os.getpid()}")  # noqa: PTH118
    try:
        os.close(os.open(probe, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
    except OSError:
        return False
    os.unlink(probe)  # noqa: PTH108
    return True


def _can_signal() -> bool:
    """Whether the process that started this one can be reached, if that is the host at all."""
    parent = os.getppid()
    try:
        if parent > 1:
            os.kill(parent, 0)
    except OSError:
        return False
    return parent > 1
