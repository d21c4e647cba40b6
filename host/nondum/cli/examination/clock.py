"""The clock: signatures end, certificates begin, and ages are told by it."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from nondum.cli.examination.finding import Finding, bad, ok, warn
from nondum.host.config.host_config import HostConfig
from nondum.wheelhouse.trust.judging import clock_unsure

_UNSYNCHRONISED = 5
"""What adjtimex(2) answers: TIME_ERROR."""
RTC = Path("/sys/class/rtc/rtc0")


def examine(config: HostConfig) -> Iterator[Finding]:
    """Look at the clock."""
    del config
    yield judge(time.time(), is_kept=RTC.exists(), is_synchronised=_is_synchronised())


def judge(now_s: float, *, is_kept: bool, is_synchronised: bool | None) -> Finding:
    """Whether the time may be believed. Pure."""
    now = datetime.fromtimestamp(now_s, UTC)
    day = now.strftime("%Y-%m-%d")
    if (unsure := clock_unsure(None, now)) is not None:
        told = (
            f"{unsure.code} it says {day}, which was before nondum: certificates of hosts do not "
            "hold yet, ages are wrong, and whether keys hold is judged by the last date that is "
            "sure"
        )
        return bad("clock", told, unsure.fix)
    if is_synchronised:
        return ok("clock", f"it says {day}, and is kept right")
    if not is_kept:
        told = f"it says {day}, nothing keeps it right, and it stands still while power is off"
        return warn("clock", told, "enable systemd-timesyncd, or fit a clock with a battery")
    told = f"it says {day}, and nothing keeps it right"
    return warn("clock", told, "enable systemd-timesyncd, where there is a network")


def _is_synchronised() -> bool | None:
    """What the kernel was told; None: it does not say."""
    buffer = ctypes.create_string_buffer(512)  # a struct timex, all zeros: nothing is set
    try:
        state: int = ctypes.CDLL(None).adjtimex(buffer)
    except (OSError, AttributeError):
        return None
    return None if state < 0 else state != _UNSYNCHRONISED
