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

    Afterwards such a signal ends the process: `asyncio.run` may wait for ever for a thread, such as
    one that could not start for want of memory.
    """
    loop, stop = asyncio.get_running_loop(), asyncio.Event()
    for number in STOP:
        loop.add_signal_handler(number, stop.set)
    try:
        yield stop
    finally:
        for number in STOP:
            loop.remove_signal_handler(number)
            signal.signal(number, signal.SIG_DFL)  # not KeyboardInterrupt, which ends no thread
