"""A fork server whose processes have used up their number: fork(2) answers EAGAIN."""

from __future__ import annotations

import os
import resource
import socket
import sys

from nondum.host.forking import fork_server

UNPRIVILEGED = 65534

if __name__ == "__main__":
    if os.geteuid() == 0:  # RLIMIT_NPROC does not limit root
        os.setgid(UNPRIVILEGED)
        os.setuid(UNPRIVILEGED)
    resource.setrlimit(resource.RLIMIT_NPROC, (0, 0))
    fork_server.serve(socket.socket(fileno=int(sys.argv[2])))
