"""What asyncio says where a client cannot be accepted for want of descriptors or memory."""

from __future__ import annotations

import asyncio
import errno
import logging
from typing import Any

log = logging.getLogger(__name__)

TOLD_S = 60.0
"""It is logged once in so long; asyncio tries again each second."""
_SHORT = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)


class AcceptFailures:
    """An exception handler of a loop: one line for many tries. All else is left to the loop's own.

    asyncio reports each try once for every client that might wait, with a traceback: a hundred
    times in one turn of the loop (its `_accept_connection`).
    """

    def __init__(self) -> None:
        self._told_s = float("-inf")

    def __call__(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """`context` is what asyncio knows of the fault (`loop.call_exception_handler`)."""
        error = context.get("exception")
        if "socket" not in context or not isinstance(error, OSError) or error.errno not in _SHORT:
            loop.default_exception_handler(context)
        elif loop.time() - self._told_s >= TOLD_S:
            self._told_s = loop.time()
            log.error("a client waits: it cannot be accepted now (%s)", error.strerror)
