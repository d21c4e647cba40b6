"""The bridge's process, forked from the daemon's fork server (`jobs/table.py`)."""

from __future__ import annotations

import asyncio
import os
import resource
import socket
import sys

from nondum.host.peers.streams.service import Service
from nondum.host.sandbox.levels import host_children

LINK = 1
"""The descriptor of the link to the daemon, with which the process ends."""
MEMORY_BYTES = 2 * 1024**3
"""What strangers send is bounded piece by piece, and all together here (setrlimit(2))."""


def main(server: int) -> None:
    """Serve until the daemon needs it no more, or the fork server ends."""
    host_children.settle(server)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    link = os.dup(LINK)
    os.dup2(sys.stderr.fileno(), LINK)  # whatever prints does not take part in the conversation
    asyncio.run(_serve(link))


async def _serve(link: int) -> None:
    await Service(socket.socket(fileno=link)).run()
