"""The signals that ask a daemon to stop."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Iterator

STOP = (signal.SIGTERM, signal.SIGINT)


@contextlib.contextmanager
def told_to_stop() -> Iterator[asyncio.Event]:
    """An event that such a signal sets, on the running loop, from the start of the daemon to its
    end.

    Afterwards such a signal ends the process: what is left of it may hang. (A thread that has no
    memory to begin with is waited for by `asyncio.run`, for ever.)
    """
    loop, stop = asyncio.get_running_loop(), asyncio.Event()
    for number in STOP:
        loop.add_signal_handler(number, stop.set)
    try:
        yield stop
    finally:
        for number in STOP:
            loop.remove_signal_handler(number)
