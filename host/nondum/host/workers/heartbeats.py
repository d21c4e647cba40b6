"""A worker's signs of life: counted, and told when they fail to come."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any


class Heartbeats:
    """Of one worker, from its start until `stop`."""

    def __init__(self, silence_s: float, on_silence: Callable[[], None]) -> None:
        """`on_silence` is called after `silence_s` without a sign, from `begin` on."""
        self._silence_s, self._on_silence = silence_s, on_silence
        self._loop = asyncio.get_running_loop()
        self._beats = 0
        self._beaten = asyncio.Event()
        self._watchdog: asyncio.TimerHandle | None = None
        self._is_over = False

    def begin(self) -> None:
        """It has started: from now on it shows signs of life, this one first."""
        self._rearm()

    def sign(self) -> None:
        """It has just shown a sign of life; until `begin`, only the startup probe counts."""
        if self._watchdog is not None:
            self._rearm()

    def beat(self) -> None:
        """One more heartbeat."""
        self._beats += 1
        self._beaten.set()

    def stop(self) -> None:
        """It is being ended: silence is told no more."""
        self._is_over = True
        if self._watchdog is not None:
            self._watchdog.cancel()

    async def wait(self, beats: int, gone: asyncio.Future[Any]) -> None:
        """Wait for `beats` further ones; return sooner when the worker is `gone`."""
        wanted = self._beats + beats
        while self._beats < wanted and not gone.done():
            self._beaten.clear()
            beaten: asyncio.Future[Any] = asyncio.ensure_future(self._beaten.wait())
            await asyncio.wait([beaten, gone], return_when=asyncio.FIRST_COMPLETED)
            beaten.cancel()

    def _rearm(self) -> None:
        if self._watchdog is not None:
            self._watchdog.cancel()
        if not self._is_over:
            self._watchdog = self._loop.call_later(self._silence_s, self._on_silence)
