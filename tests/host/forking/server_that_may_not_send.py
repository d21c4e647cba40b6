"""A fork server that can send no descriptor until it is asked a second time: too many of its user's
are under way (ETOOMANYREFS, unix(7))."""

from __future__ import annotations

import os
import resource
import socket
import sys

from nondum.host.forking import fork_server

MANY = 250

if __name__ == "__main__":
    if os.geteuid() == 0:  # root is not held to it, and the descriptors of all of a user count
        os.setgid(50_000 + os.getpid() % 10_000)
        os.setuid(os.getgid())
    resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64))
    full, unread = socket.socketpair()
    socket.send_fds(full, [b"x"], [0] * MANY)
    asked: list[bytes] = []

    def prepare(message: bytes) -> None:
        """Receive them at the second request, so that the kernel closes them. To close the socket
        is not enough: the process that was forked for the first request may still hold it."""
        asked.append(message)
        if len(asked) == 2:
            unread.recv(1)

    fork_server.serve(socket.socket(fileno=int(sys.argv[2])), prepare=prepare)
