"""Waiting in tests: one patience, one message, whatever is waited for.

Await an event where there is one (`VirtualClock.settle`, a bus, a view). These two are for state
outside the process, which nothing announces: processes, files, mounts.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Awaitable, Callable
from typing import TypeVar

from demo.robot import TooLate

PATIENCE_S = 60.0
"""Longest wait of a helper, below pytest's own time-out: so that the message is the helper's."""

LOOK_S = 0.01
"""Between two looks."""

_T = TypeVar("_T")


def until(
    what: str,
    look: Callable[[], _T],
    *,
    evidence: Callable[[], object] = str,
    patience_s: float = PATIENCE_S,
) -> _T:
    """Look until there is something true, and return it.

    Raises `TooLate`, which says what was waited for and the `evidence`: a log, the last state.
    """
    end_s = time.monotonic() + patience_s
    while not (found := look()):
        if time.monotonic() > end_s:
            raise TooLate(f"{what}: not within {patience_s:.0f} s\n{evidence()}")
        time.sleep(LOOK_S)
    return found


async def until_async(
    what: str,
    look: Callable[[], _T],
    *,
    evidence: Callable[[], object] = str,
    patience_s: float = PATIENCE_S,
) -> _T:
    """The same on an event loop, in real time, also where the loop's time is virtual."""
    end_s = time.monotonic() + patience_s
    while not (found := look()):
        if time.monotonic() > end_s:
            raise TooLate(f"{what}: not within {patience_s:.0f} s\n{evidence()}")
        await asyncio.to_thread(time.sleep, LOOK_S)
    return found


async def arrived(
    what: str,
    awaited: Awaitable[_T],
    *,
    evidence: Callable[[], object] = str,
    patience_s: float = PATIENCE_S,
) -> _T:
    """Await an event with the same patience: in real time, also where the loop's time is virtual.

    Raises `TooLate` as `until` does.
    """
    loop, task = asyncio.get_running_loop(), asyncio.ensure_future(awaited)
    is_late = False

    def give_up() -> None:
        nonlocal is_late
        is_late = task.cancel()

    alarm = threading.Timer(patience_s, loop.call_soon_threadsafe, [give_up])
    alarm.daemon = True
    alarm.start()
    try:
        return await task
    except asyncio.CancelledError:
        if not is_late:
            raise
        raise TooLate(f"{what}: not within {patience_s:.0f} s\n{evidence()}") from None
    finally:
        alarm.cancel()
        task.cancel()
