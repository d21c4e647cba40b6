"""Log records as events to the host."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable, Mapping
from typing import Any

MAX_MESSAGE = 8192
"""Characters of one log message."""
MAX_PER_SECOND = 200
"""Records that are sent in one second: a flood must not crowd out what behaviours tell."""


class EventHandler(logging.Handler):
    """Sends records as `log` events, from whichever thread they come, and tells what it left out.

    Make it on the loop that `tell` belongs to.
    """

    def __init__(self, tell: Callable[[str, Mapping[str, Any]], None]) -> None:
        super().__init__()
        self._tell = tell
        self._loop = asyncio.get_running_loop()
        self._window_s = 0.0
        self._sent = self._left_out = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Send one record; a record that cannot be formatted is logging's own affair."""
        if not self._may_send(time.monotonic()):
            return
        try:
            message = self.format(record)[:MAX_MESSAGE]
        except Exception:
            self.handleError(record)
            return
        self._send(record.levelname.lower(), message)

    def _may_send(self, now_s: float) -> bool:
        """Count the record into its second (the handler's lock is held)."""
        if now_s - self._window_s >= 1:
            self._window_s, self._sent = now_s, 0
        self._sent += 1
        if self._sent <= MAX_PER_SECOND:
            return True
        if not self._left_out:
            with contextlib.suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._loop.call_later, 1, self._tell_left_out)
        self._left_out += 1
        return False

    def _tell_left_out(self) -> None:
        with self.lock or contextlib.nullcontext():
            left_out, self._left_out = self._left_out, 0
        self._send("warning", f"{left_out} log records were left out")

    def _send(self, level: str, message: str) -> None:
        event = {"level": level, "message": message}
        with contextlib.suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(self._tell, "log", event)
