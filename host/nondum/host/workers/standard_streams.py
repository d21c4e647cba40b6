"""A worker's standard streams: each line is told, and the last ones are kept for its end."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Sequence
from typing import IO

from nondum.host.core.events.event import Emit
from nondum.host.core.events.workers import WorkerLogged
from nondum.host.core.printable import printable
from nondum.host.workers.loop_stacks import Standstill
from nondum.host.workers.output import Output

TAIL_LINES = 12
"""Lines of standard error that are told with an exit."""


class StandardStreams:
    """Standard output and error of one worker, which it owns."""

    def __init__(
        self, component: str, package: str, pipes: Sequence[IO[bytes]], emit: Emit
    ) -> None:
        """`package` is the plugin's own. Raises `OSError` when a pipe cannot be read."""
        self._component, self._emit = component, emit
        self._tail: deque[str] = deque(maxlen=TAIL_LINES)
        self.standstill = Standstill(package)
        """Where its loop stood, as far as it has written that."""
        self._outputs: list[Output] = []
        with contextlib.ExitStack() as failed:
            failed.callback(self.close)
            for source, pipe in zip(("stdout", "stderr"), pipes, strict=True):
                self._outputs.append(Output(source, pipe, self._on_line))
            failed.pop_all()

    @property
    def tail(self) -> tuple[str, ...]:
        """The last lines of standard error."""
        return tuple(self._tail)

    def close(self) -> None:
        """Take what is there now and let go."""
        for output in self._outputs:
            output.close()

    def _on_line(self, source: str, line: str) -> None:
        text = printable(line)
        if source == "stderr" and not self.standstill.take(line):
            self._tail.append(text)
        self._emit(WorkerLogged(self._component, source, text))
