"""Where a worker's loop stood when it stopped, read from what its SDK wrote before it was ended.

The format is that of `faulthandler.dump_traceback_later`: the threads one after the other, the
innermost frame of each first, the main thread last. A plugin can write what it likes there; it is
only told to people.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

MAX_LINES = 2000
"""Lines of one dump that are kept."""

_BEGIN = re.compile(r"Timeout \(\d+:\d\d:\d\d(\.\d+)?\)!")
_THREAD = re.compile(r"(Current thread|Thread) 0x[0-9a-f]+ .*\(most recent call first\):")
_FRAME = re.compile(r'  File "(?P<file>.*)", line (?P<line>\d+) in (?P<name>.*)')
_LOOP = "/nondum/sdk/worker.py"
"""A file that only the thread of the loop has among its frames."""


@dataclass(slots=True)
class Standstill:
    """The last dump of a worker, taken from its standard error line by line."""

    package: str
    """Name of the plugin's own package or module."""
    _threads: list[list[tuple[str, str, str]]] = field(default_factory=list)
    _left: int = 0

    def take(self, line: str) -> bool:
        """Take in a line. Says whether it was one of a dump."""
        if _BEGIN.fullmatch(line):
            self._threads, self._left = [], MAX_LINES
            return True
        if self._left <= 0:
            return False
        self._left -= 1
        if _THREAD.fullmatch(line):
            self._threads.append([])
            return True
        frame = _FRAME.fullmatch(line)
        if frame is not None and self._threads:
            self._threads[-1].append((frame["file"], frame["line"], frame["name"]))
            return True
        is_between = not line.strip() or line == "  ..."
        self._left = self._left if is_between else 0
        return is_between

    def forget(self) -> None:
        """The loop goes on: it was only slow."""
        self._threads, self._left = [], 0

    @property
    def place(self) -> str:
        """`watch, gps/plugin.py:33`: the plugin's innermost frame on the loop; empty: not known."""
        frames = next((t for t in self._threads if any(_LOOP in f for f, _, _ in t)), [])
        installed = [frame for frame in frames if "/site-packages/" in frame[0]]
        own = [frame for frame in installed if self._is_own(frame[0])]
        for file, line, name in own or installed:
            if "/nondum/sdk/" not in file:
                return f"{name}, {file.rpartition('/site-packages/')[2]}:{line}"
        return ""

    def _is_own(self, file: str) -> bool:
        inside = file.rpartition("/site-packages/")[2]
        return inside.startswith(f"{self.package}/") or inside == f"{self.package}.py"
