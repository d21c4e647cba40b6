"""That process: `python -I -P -m nondum.host.peers.links PIPE DAEMON MEMORY`.

`PIPE` is the descriptor of the pipe to the daemon, `DAEMON` its process id, `MEMORY` the bytes that
it may have. It ends with the daemon, and when anything fails in it: the daemon starts another.
"""

from __future__ import annotations

import asyncio
import fcntl
import logging
import os
import resource
import socket
import sys
from typing import Any

from nondum.host.sandbox.levels import host_children
from nondum.transport.peers.socket_process.service import Service

FAILED = 70
"""Exit status after an internal failure (sysexits.h, EX_SOFTWARE)."""


def main(pipe: int, daemon: int, memory: int) -> int:
    """Serve until the daemon is gone, or needs it no more."""
    host_children.settle(daemon)
    resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    fcntl.fcntl(pipe, fcntl.F_SETFD, fcntl.FD_CLOEXEC)
    asyncio.run(_serve(pipe))
    return 0


async def _serve(pipe: int) -> None:
    asyncio.get_running_loop().set_exception_handler(_fail)
    await Service(socket.socket(fileno=pipe)).run()


def _fail(_loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """End: half of what holds strangers off may be gone, for want of memory above all."""
    try:
        logging.error("%s", context.get("message"), exc_info=context.get("exception"))
    finally:
        os._exit(FAILED)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
