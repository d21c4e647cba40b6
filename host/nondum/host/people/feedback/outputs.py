"""The interface of outputs that show a state. Each output runs in a separate task, is given the
newest state first, and cannot block anything else."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

from nondum.host.core.feedback_state import StateReason
from nondum.host.extension.hookspecs import Output
from nondum.sdk.errors import NondumError

log = logging.getLogger(__name__)


class Outlet:
    """Shows one output the newest state, one at a time, while `run` runs."""

    def __init__(self, output: Output, on_change: Callable[[], None] = lambda: None) -> None:
        """`on_change` is called when there are other `problems`."""
        self._on_change = on_change
        self.problems: tuple[str, ...] = ()
        """Why the last state could not be shown; told in every status."""
        self._output = output
        self._newest: StateReason | None = None
        self._news = asyncio.Event()

    def show(self, reason: StateReason) -> None:
        """Have a state shown, instead of what waits to be; never blocks."""
        self._newest = reason
        self._news.set()

    async def run(self) -> None:
        """Show states until cancelled."""
        try:
            while True:
                await self._news.wait()
                self._news.clear()
                if self._newest is not None:
                    await self._show(self._newest)
        finally:
            await asyncio.shield(self._end())

    async def _show(self, reason: StateReason) -> None:
        try:
            await self._output.show(reason)
        except NondumError as error:
            self._note(tuple(map(str, error.problems)))
        except Exception as error:  # a lamp must not end the robot
            log.exception("feedback: %s", type(self._output).__name__)
            self._note((f"{type(self._output).__name__}: {error!r}",))
        else:
            self._note(())

    async def _end(self) -> None:
        try:
            await self._output.end()
        except Exception:  # all else ends, too
            log.exception("feedback: %s", type(self._output).__name__)

    def _note(self, problems: tuple[str, ...]) -> None:
        if problems and problems != self.problems:
            log.warning("feedback: %s", "; ".join(problems))
        elif self.problems and not problems:
            log.info("feedback: it works again: %s", "; ".join(self.problems))
        if problems != self.problems:
            self.problems = problems
            self._on_change()
