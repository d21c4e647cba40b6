"""The bridge's process: `python -I -m nondum.host.bridge LINK DAEMON`.

`LINK` is the descriptor of the link to the daemon, `DAEMON` its process id. It ends with either.
"""

from __future__ import annotations

import asyncio
import ctypes
import fcntl
import os
import resource
import signal
import socket
import sys

from nondum.host.bridge.service import Service

MEMORY_BYTES = 2 * 1024**3
"""What strangers send is bounded piece by piece, and all together here (setrlimit(2))."""
_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def main(link: int, daemon: int) -> int:
    """Serve until the daemon is gone, or needs it no more."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != daemon:  # it died before this was asked for
        return 1
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    fcntl.fcntl(link, fcntl.F_SETFD, fcntl.FD_CLOEXEC)
    asyncio.run(_serve(link))
    return 0


async def _serve(link: int) -> None:
    await Service(socket.socket(fileno=link)).run()


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2])))
