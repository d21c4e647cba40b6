"""The bridge's process, forked from the daemon's fork server (`jobs/table.py`)."""

from __future__ import annotations

import asyncio
import resource
import socket

from nondum.host.peers.streams.service import Service
from nondum.host.rpc.channel import conversation
from nondum.host.sandbox.levels import host_children

MEMORY_BYTES = 2 * 1024**3
"""What strangers send is bounded piece by piece, and all together here (setrlimit(2))."""


def main(server: int) -> None:
    """Serve until the daemon closes the link, or the fork server ends."""
    host_children.settle(server)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    asyncio.run(_serve(conversation()))


async def _serve(link: socket.socket) -> None:
    await Service(link).run()
