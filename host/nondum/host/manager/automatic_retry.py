"""Automatic retry: after an hour, an unattended host tries once more what daemons died of."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from nondum.host.core.events.daemon import SafeModeLeft, TrialDue
from nondum.host.core.events.event import Emit
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.lifecycle.crash_attribution import STEADY_S
from nondum.host.manager.crash_loop import CrashCounter

AFTER_S = 3600.0
"""The age of a daemon at which it tries."""
APART_S = 12 * STEADY_S
"""Between two trials: if a daemon dies, it is known of which."""


async def hold(snapshot: Callable[[], Snapshot], counter: CrashCounter, emit: Emit) -> None:
    """Leave safe mode, if daemons that died are all that it is for, then have what was left alone
    tried, one after the other, until cancelled. By the time of the event loop."""
    await asyncio.sleep(AFTER_S)
    host = snapshot().host
    if snapshot().safety is not Safety.OFF and await counter.may_leave_safe_mode():
        emit(SafeModeLeft(host, "it has lasted for an hour"))
        await counter.outlive()
    while True:
        emit(TrialDue(host))
        await asyncio.sleep(APART_S)
