"""The monitor of a QEMU: commands and their answers.

Source: QEMU Machine Protocol, docs/interop/qmp-spec.
"""

from __future__ import annotations

import json
import socket
from pathlib import Path
from typing import Any

PATIENCE_S = 30.0


class QmpError(Exception):
    """QEMU would not do what it was told."""


class Qmp:
    """One connection to a monitor."""

    def __init__(self, path: Path) -> None:
        """Connect. Raises `OSError` while QEMU does not listen yet."""
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.settimeout(PATIENCE_S)
        try:
            self._socket.connect(str(path))
        except OSError:
            self._socket.close()
            raise
        self._lines = self._socket.makefile("rb")
        self._next()  # the greeting
        self.do("qmp_capabilities")

    def do(self, command: str, **arguments: Any) -> Any:
        """Give a command, and wait for its answer; underscores in names stand for hyphens.

        Raises `QmpError`.
        """
        named = {name.replace("_", "-"): value for name, value in arguments.items()}
        request = {"execute": command, "arguments": named}
        self._socket.sendall(json.dumps(request).encode() + b"\n")
        while True:
            answer = self._next()
            if "error" in answer:
                raise QmpError(f"{command} {named}: {answer['error']['desc']}")
            if "return" in answer:
                return answer["return"]

    def until(self, event: str, **data: Any) -> None:
        """Wait for an event that comes from now on, with these data."""
        while True:
            said = self._next()
            if said.get("event") == event and data.items() <= said.get("data", {}).items():
                return

    def close(self) -> None:
        """Leave QEMU alone."""
        self._lines.close()
        self._socket.close()

    def _next(self) -> dict[str, Any]:
        line = self._lines.readline()
        if not line:
            raise QmpError("QEMU has ended")
        said: dict[str, Any] = json.loads(line)
        return said
