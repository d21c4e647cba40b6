"""Log records as events to the host."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Mapping
from typing import Any

MAX_MESSAGE = 8192
"""Characters of one log message."""


class EventHandler(logging.Handler):
    """Sends every record as a `log` event, from whichever thread it comes.

    Make it on the loop that `tell` belongs to.
    """

    def __init__(self, tell: Callable[[str, Mapping[str, Any]], None]) -> None:
        super().__init__()
        self._tell = tell
        self._loop = asyncio.get_running_loop()

    def emit(self, record: logging.LogRecord) -> None:
        """Send one record; a record that cannot be formatted is logging's own affair."""
        try:
            message = self.format(record)[:MAX_MESSAGE]
        except Exception:
            self.handleError(record)
            return
        event = {"level": record.levelname.lower(), "message": message}
        with contextlib.suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(self._tell, "log", event)
