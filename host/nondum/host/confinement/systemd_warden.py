"""The warden: root's end of one worker of level 2. It has systemd start the service, and ends the
service as soon as who asked for it is gone.

Started for each connection, by nondum-warden.socket or by a daemon that is root itself. A packet
comes with three descriptors (orders, standard output, standard error); then `TERM` and `ORPHANED`
may come, and at last the answer goes back: how the service ended.
"""

from __future__ import annotations

import argparse
import contextlib
import grp
import json
import os
import pwd
import select
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import IO

from nondum.host.confinement import bubblewrap, systemd
from nondum.host.confinement.systemd import Machine, Request

TERM, ORPHANED = b"TERM", b"ORPHANED"
LAST_WORDS = b"MemoryError: the service has used up its memory\n"
"""Said for a worker that could not say so itself; its daemon knows these words."""
ORPHAN_S = 2.0
"""What a worker has, once its daemon is gone, to leave everything safe."""
_POLL_MS = 200
_SHOWN = ("Result", "ExecMainCode", "ExecMainStatus")
_CREDENTIALS = struct.Struct("3i")
_GROUPS = ("dialout", "video", "audio", "render", "plugdev", "i2c", "spi", "gpio")
_DESCRIPTORS = 3


def main(arguments: Sequence[str] | None = None) -> None:
    """Serve the connection that is standard input."""
    told = _parser().parse_args(arguments)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # it ends with its service, which it ends first
    with socket.socket(fileno=os.dup(0)) as connection:
        user = pwd.getpwnam(told.user).pw_uid if told.user else os.getuid()
        if _peer(connection)[1] != user:
            raise SystemExit("this user is not served")
        places = (told.state / "venvs", *told.place)
        attend(connection, [place.resolve() for place in places])


def attend(connection: socket.socket, places: Sequence[Path]) -> None:
    """Have one service as long as it is wanted. Raises `ValueError` for a request like no other."""
    data, given, _, _ = socket.recv_fds(connection, systemd.MAX_BYTES + 1, _DESCRIPTORS)
    with contextlib.ExitStack() as held:
        descriptors = [held.enter_context(os.fdopen(each, "wb", 0)) for each in given]
        request = systemd.parse(data, places)
        if len(descriptors) != _DESCRIPTORS:
            raise ValueError("a request brings three descriptors")
        unit = systemd.unit_of(request.component, _peer(connection)[0])
        orders, output, errors = descriptors
        running = _started(request, unit, orders, output, errors)
        orders.close()
        output.close()
        _until_ended(running, connection, unit)
        ended = _ended(unit, running.returncode)
        with contextlib.suppress(OSError):  # nobody waits for it
            if ended["Result"] == "oom-kill":
                errors.write(LAST_WORDS)
            connection.send(json.dumps(ended).encode())
    _systemctl("reset-failed", unit)


def machine() -> Machine:
    """This one."""
    names = [e.name for e in Path("/").iterdir() if e.is_dir() and not e.is_symlink()]
    known = {group.gr_name for group in grp.getgrall()}
    return Machine(
        python=Path(getattr(sys, "_base_executable", None) or sys.executable),
        top=tuple(sorted(names)),
        groups=tuple(name for name in _GROUPS if name in known),
        prefixes=tuple(bubblewrap.prefixes()),
    )


def _started(
    request: Request, unit: str, orders: IO[bytes], output: IO[bytes], errors: IO[bytes]
) -> subprocess.Popen[bytes]:
    words = systemd.command(request, unit, machine())
    return subprocess.Popen(words, stdin=orders, stdout=output, stderr=errors, cwd="/")


def _until_ended(running: subprocess.Popen[bytes], connection: socket.socket, unit: str) -> None:
    pidfd = os.pidfd_open(running.pid)
    poll = select.poll()
    poll.register(pidfd, select.POLLIN)
    poll.register(connection, select.POLLIN)
    is_wanted = True
    try:
        while not (ready := dict(poll.poll(-1 if is_wanted else _POLL_MS))).get(pidfd):
            if ready:
                said = _heard(connection)
                is_wanted = said == TERM
                if said == ORPHANED and select.select([pidfd], [], [], ORPHAN_S)[0]:
                    break
                if not is_wanted:
                    poll.unregister(connection)
            # Again and again: the service may only be about to start.
            _systemctl("kill", f"--signal={'TERM' if is_wanted else 'KILL'}", unit)
    finally:
        os.close(pidfd)
    running.wait()


def _heard(connection: socket.socket) -> bytes:
    try:
        return connection.recv(64)
    except OSError:
        return b""


def _ended(unit: str, status: int) -> dict[str, str]:
    """How it ended, as systemd says; the status of systemd-run where there was no service."""
    said = _systemctl("show", *(f"--property={name}" for name in _SHOWN), unit)
    shown = dict(line.split("=", 1) for line in said.splitlines() if "=" in line)
    if shown.get("ExecMainCode", "0") == "0":
        return {"Result": "failed", "ExecMainCode": "1", "ExecMainStatus": str(status or 1)}
    return shown


def _systemctl(*words: str) -> str:
    done = subprocess.run(
        ["systemctl", *words], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )
    return done.stdout


def _peer(connection: socket.socket) -> tuple[int, int]:
    """The process at the other end, and its user (SO_PEERCRED, unix(7))."""
    told = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    process, user, _ = _CREDENTIALS.unpack(told)
    return process, user


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="nondum-warden", description=__doc__)
    parser.add_argument("--user", default="", help="the one user who is served (its own)")
    parser.add_argument(
        "--state", type=Path, default=Path("/var/lib/nondum"), help="that user's state folder"
    )
    parser.add_argument(
        "--place", type=Path, action="append", default=[], help="where else workers' code is"
    )
    return parser


if __name__ == "__main__":
    main()
