"""Waits for the stop key to be pressed, and looks for its device again when that is gone."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from contextlib import closing
from pathlib import Path

from nondum.host.config.stop_keys import code_of
from nondum.host.config.stop_section import StopSection
from nondum.host.core.keyed_queues import in_thread
from nondum.host.sandbox.helper.presses import Presses
from nondum.host.sandbox.helper.privileged import privileged
from nondum.sdk.errors import NondumError

AGAIN_S = 1.0
"""Before a device that is not there is looked for again."""

log = logging.getLogger(__name__)


class StopButton:
    """Calls back for each press, while `run` runs."""

    def __init__(
        self,
        section: StopSection,
        on_press: Callable[[], Awaitable[None]],
        opened: Callable[[Path, int], Presses] | None = None,
    ) -> None:
        """`opened` listens to a key, if not as this process may: it may block, and raises
        `NondumError`."""
        self._path, self._code = Path(section.device), code_of(section.key) or 0
        self._is_wanted = bool(section.device)
        self._on_press, self._opened = on_press, opened or privileged().stop_key
        self._problem: NondumError | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """What every status says of it."""
        return (str(self._problem),) if self._problem is not None else ()

    async def run(self) -> None:
        """Listen until cancelled."""
        while self._is_wanted:
            try:
                presses = await in_thread(self._opened, self._path, self._code)
            except NondumError as problem:
                self._tell(problem)
                await asyncio.sleep(AGAIN_S)
                continue
            self._tell(None)
            with closing(presses):
                await self._listen(presses)

    async def _listen(self, presses: Presses) -> None:
        """Until the device is gone."""
        pressed = int(presses.is_down_at_first)
        while True:
            if pressed:
                await self._on_press()
            await _readable(presses.fileno())
            try:
                pressed = presses.read()
            except OSError:
                return

    def _tell(self, problem: NondumError | None) -> None:
        """Log each change, once."""
        if str(problem) != str(self._problem):
            if problem is not None:
                log.warning("%s", problem)
            else:
                log.info("the stop key works")
        self._problem = problem


async def _readable(descriptor: int) -> None:
    loop = asyncio.get_running_loop()
    ready = asyncio.Event()
    loop.add_reader(descriptor, ready.set)
    try:
        await ready.wait()
    finally:
        loop.remove_reader(descriptor)
