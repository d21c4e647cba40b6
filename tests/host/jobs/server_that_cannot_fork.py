"""A fork server whose processes have used up their number: fork(2) answers EAGAIN."""

from __future__ import annotations

import os
import resource
import socket
import sys

from nondum.host.jobs import fork_server

NOBODY = 65534

if __name__ == "__main__":
    if os.geteuid() == 0:  # whom no number bounds
        os.setgid(NOBODY)
        os.setuid(NOBODY)
    resource.setrlimit(resource.RLIMIT_NPROC, (0, 0))
    fork_server.serve(socket.socket(fileno=int(sys.argv[2])))
