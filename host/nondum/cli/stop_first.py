"""`nondum stop`, asked before the command line is imported, which takes longer than a stop.

So it imports next to nothing; the command itself shows the answer.
"""

from __future__ import annotations

import contextlib
import os
import socket

from nondum.host.config.control_sockets import usual_sockets

CONTROL = "NONDUM_CONTROL"
"""The variable that names the daemon's control socket."""
STOP = b'{"verb":"goal","arguments":{"words":"stop"}}\n'
"""The request, as `nondum.host.control.protocol` writes it."""


def ask_to_stop() -> tuple[str, socket.socket] | None:
    """Ask the daemon that the command would ask: its socket's path, and the connection over which
    the answer comes. None where no daemon answers."""
    named = os.environ.get(CONTROL)
    for path in [named] if named else usual_sockets():
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        with contextlib.suppress(OSError):
            connection.connect(path)
            connection.sendall(STOP)
            return path, connection
        connection.close()
    return None
