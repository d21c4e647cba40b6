"""The bridge's process: `python -I -m nondum.host.bridge LINK DAEMON`.

`LINK` is the descriptor of the link to the daemon, `DAEMON` its process id. It ends with either.
"""

from __future__ import annotations

import asyncio
import fcntl
import resource
import socket
import sys

from nondum.host.bridge.service import Service
from nondum.host.confinement import own_children

MEMORY_BYTES = 2 * 1024**3
"""What strangers send is bounded piece by piece, and all together here (setrlimit(2))."""


def main(link: int, daemon: int) -> int:
    """Serve until the daemon is gone, or needs it no more."""
    own_children.settle(daemon)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    fcntl.fcntl(link, fcntl.F_SETFD, fcntl.FD_CLOEXEC)
    asyncio.run(_serve(link))
    return 0


async def _serve(link: int) -> None:
    await Service(socket.socket(fileno=link)).run()


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2])))
