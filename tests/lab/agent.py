"""The near end of the line to a machine's agent (`inside/agent.py`): programs run, files put."""

from __future__ import annotations

import base64
import contextlib
import itertools
import json
import queue
import socket
import threading
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any

TOO_LONG = 124
"""Status of a program that ran too long (see `inside/agent.py`)."""
SLACK_S = 60.0
"""How much longer than the program may run its answer is waited for."""


class MachineSilent(Exception):
    """The machine does not answer."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a program ended, and what it wrote."""

    command: str
    status: int
    out: str
    err: str

    def __str__(self) -> str:
        said = "\n".join(text for text in (self.out.strip(), self.err.strip()) if text)
        return f"{self.command}\nexited with {self.status}\n{said}"

    def json(self) -> Any:
        """Its output, as JSON."""
        return json.loads(self.out)


class CommandFailed(AssertionError):
    """A program inside the machine exited with another status than 0."""


class Agent:
    """Talks with one machine over all of its boots. Safe to use from several threads."""

    def __init__(self, path: Path) -> None:
        """Connect to the serial port's socket. Raises `OSError` while QEMU does not listen yet."""
        self._socket = socket.socket(socket.AF_UNIX)
        try:
            self._socket.connect(str(path))
        except OSError:
            self._socket.close()
            raise
        self._boots: queue.Queue[str] = queue.Queue()
        self._numbers = itertools.count(1)
        self._waiting: dict[int, Future[dict[str, Any]]] = {}
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def wait_for_boot(self, timeout_s: float) -> str:
        """Wait until the agent says hello; answers the boot's id. Raises `MachineSilent`."""
        try:
            boot = self._boots.get(timeout=timeout_s)
        except queue.Empty:
            raise MachineSilent(f"no hello in {timeout_s:.0f} s") from None
        if not boot:
            raise MachineSilent("QEMU has ended")
        return boot

    def run(self, *words: str, timeout_s: float = 60.0, stdin: bytes = b"") -> Outcome:
        """Run a program and wait for its end, whatever its status. Raises `MachineSilent`."""
        request = {"run": words, "timeout_s": timeout_s, "stdin": _encoded(stdin)}
        answer = self._ask(request, timeout_s + SLACK_S)
        out, err = (
            base64.b64decode(answer[key]).decode(errors="replace") for key in ("out", "err")
        )
        return Outcome(" ".join(words), answer["status"], out, err)

    def put(self, path: str, data: bytes, mode: int = 0o644) -> None:
        """Write a file inside. Raises `CommandFailed`, `MachineSilent`."""
        answer = self._ask({"put": path, "data": _encoded(data), "mode": mode}, SLACK_S)
        if answer["status"] != 0:
            raise CommandFailed(f"{path}: {base64.b64decode(answer['err']).decode()}")

    def close(self) -> None:
        """Hang up."""
        with contextlib.suppress(OSError):  # QEMU has hung up
            self._socket.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        self._socket.close()

    def _ask(self, request: dict[str, Any], timeout_s: float) -> dict[str, Any]:
        answer: Future[dict[str, Any]] = Future()
        with self._lock:
            number = next(self._numbers)
            self._waiting[number] = answer
            try:
                self._socket.sendall(json.dumps({"id": number, **request}).encode() + b"\n")
            except OSError as error:
                raise MachineSilent("QEMU has ended") from error
        try:
            return answer.result(timeout_s)
        except TimeoutError:
            raise MachineSilent(f"no answer in {timeout_s:.0f} s: {request}") from None
        finally:
            self._waiting.pop(number, None)

    def _read(self) -> None:
        with self._socket.makefile("rb") as lines, contextlib.suppress(ConnectionError):
            for line in lines:
                said = json.loads(line)
                if "hello" in said:
                    self._boots.put(said["hello"])
                elif said["id"] in self._waiting:
                    self._waiting[said["id"]].set_result(said)
        self._boots.put("")
        for answer in list(self._waiting.values()):
            if not answer.done():
                answer.set_exception(MachineSilent("QEMU has ended"))


def _encoded(data: bytes) -> str:
    return base64.b64encode(data).decode()
