"""Refuses a drive that is read too slowly: two of them would hold up all other drives for ever.

Such a drive never runs into a read timeout. So each copy demands a pace that any stick has.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from nondum.sdk.errors import DriveGone, Problem

LEAST_BYTES_S = 32 * 1024
"""A small part of what USB 1.1 gives (usb.org: 12 Mbit/s)."""
WINDOW_S = 20.0
"""The pace is looked at over so long, so that a drive may pause."""

Report = Callable[[str, int, int], None]
"""Phase, bytes done, bytes in all."""


def paced(report: Report, drive: str, now_s: Callable[[], float] = time.monotonic) -> Report:
    """The same report, which raises `DriveGone` (DRIVE_STALLED) when a drive is too slow."""
    since_s, had = now_s(), 0

    def tell(phase: str, done: int, total: int) -> None:
        nonlocal since_s, had
        passed_s = now_s() - since_s
        if passed_s >= WINDOW_S:
            if done < total and done - had < LEAST_BYTES_S * passed_s:
                raise DriveGone(_slow(drive, (done - had) / passed_s))
            since_s, had = since_s + passed_s, done
        report(phase, done, total)

    return tell


def _slow(drive: str, bytes_s: float) -> Problem:
    return Problem(
        "DRIVE_STALLED",
        "gives its files too slowly",
        where=drive,
        need=f"{LEAST_BYTES_S // 1024} kB a second",
        have=f"{bytes_s / 1024:.1f}",
        fix="pull it and plug it in again, or copy the payload to another drive",
    )
