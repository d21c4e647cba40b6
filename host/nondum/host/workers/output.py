"""Drains a worker's standard output and error, however much it writes.

64 KiB a second are kept, as lines; what is more is read slowly, counted and dropped, so that a
flood costs the host next to nothing and does not block the worker for good.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from typing import IO, TypeAlias

from nondum.transport import TokenBucket

RATE_BYTES_S = 64 * 1024
BURST_BYTES = 128 * 1024
PAUSE_S = 0.05
"""Between two reads of a flood."""
CHUNK = 64 * 1024
MAX_LINE = 4096
"""Bytes without a line's end that are taken for a line."""

OnLine: TypeAlias = Callable[[str, str], None]
"""Takes the source (`stdout` or `stderr`) and a line."""


class Valve:
    """Lets 64 KiB a second through, and counts what it does not."""

    def __init__(self, now_s: Callable[[], float]) -> None:
        self._now_s = now_s
        self._bucket = TokenBucket(RATE_BYTES_S, BURST_BYTES, now_s())
        self.dropped = 0
        """Bytes that did not pass, since they were last told."""

    def passes(self, size: int) -> bool:
        """Whether so much may pass now; it is counted otherwise."""
        if self._bucket.take(size, self._now_s()):
            return True
        self.dropped += size
        return False

    def told(self) -> str:
        """What there is to tell of what did not pass, once; empty: nothing."""
        dropped, self.dropped = self.dropped, 0
        return f"LOG_DROPPED {dropped} bytes were too many" if dropped else ""


class Output:
    """One pipe of a worker, which it owns."""

    def __init__(self, source: str, pipe: IO[bytes], on_line: OnLine) -> None:
        self._source, self._pipe, self._on_line = source, pipe, on_line
        self._loop = asyncio.get_running_loop()
        self._valve = Valve(self._loop.time)
        self._unfinished = b""
        self._resume: asyncio.TimerHandle | None = None
        os.set_blocking(pipe.fileno(), False)
        self._loop.add_reader(pipe.fileno(), self._on_readable)

    def close(self) -> None:
        """Take what is there now and let go; a child that still writes gets SIGPIPE."""
        if self._pipe.closed:
            return
        while self._read() and not self._valve.dropped:
            pass
        self._stop()

    def _on_readable(self) -> None:
        if not self._read():
            self._stop()
        elif self._valve.dropped:
            self._loop.remove_reader(self._pipe.fileno())
            self._resume = self._loop.call_later(PAUSE_S, self._read_on)

    def _read_on(self) -> None:
        self._resume = None
        self._loop.add_reader(self._pipe.fileno(), self._on_readable)

    def _read(self) -> bool:
        """Take one chunk; answer whether there was one."""
        try:
            data = os.read(self._pipe.fileno(), CHUNK)
        except BlockingIOError:
            return False
        if data and not self._valve.passes(len(data)):
            return True
        self._tell_dropped()
        self._split(data)
        return bool(data)

    def _split(self, data: bytes) -> None:
        *lines, self._unfinished = (self._unfinished + data).split(b"\n")
        for line in lines:
            self._say(line)
        while len(self._unfinished) > MAX_LINE:
            self._say(self._unfinished[:MAX_LINE])
            self._unfinished = self._unfinished[MAX_LINE:]

    def _tell_dropped(self) -> None:
        if told := self._valve.told():
            self._on_line(self._source, told)

    def _say(self, line: bytes) -> None:
        self._on_line(self._source, line.decode("utf-8", "replace"))

    def _stop(self) -> None:
        self._tell_dropped()
        if self._unfinished:
            self._say(self._unfinished)
            self._unfinished = b""
        if self._resume is not None:
            self._resume.cancel()
        self._loop.remove_reader(self._pipe.fileno())
        self._pipe.close()
