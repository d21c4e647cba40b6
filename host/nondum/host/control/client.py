"""A client's end of the control socket: blocking, and quick to import."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

from nondum.host.control import protocol
from nondum.sdk.errors import (
    GoalRefused,
    HostUnreachable,
    NondumError,
    Problem,
    ProtocolViolation,
)

_ANSWER_PART = 64 * 1024
"""Bytes taken at once of an answer that a connection comes with."""
_NO_CONNECTION = Problem(
    "CONTROL_ANSWER",
    "the answer has no connection with it",
    where="control socket",
    fix="is command and daemon of one version?",
)


class ControlClient:
    """One connection to a daemon."""

    def __init__(
        self,
        path: Path,
        *,
        timeout_s: float | None = 30.0,
        connection: socket.socket | None = None,
    ) -> None:
        """Connect, unless by `connection`. Raises `HostUnreachable` when no daemon listens at
        `path`."""
        self._socket = connection or socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(timeout_s)
        try:
            if connection is None:
                self._socket.connect(str(path))
        except OSError as error:
            self._socket.close()
            raise _unreachable(path, error) from error
        self._path = path
        self._lines = self._socket.makefile("rb")

    def ask(self, verb: str, **arguments: Any) -> Any:
        """Send one request and return its result.

        Raises `NondumError` with what the host says, `HostUnreachable` when it goes away or does
        not answer in time.
        """
        self._send(verb, arguments)
        return self.answer()

    def ask_for_connection(self, verb: str, **arguments: Any) -> tuple[Any, socket.socket]:
        """The same for a verb whose answer a connection goes along with; the caller closes it."""
        self._send(verb, arguments)
        line, handles = b"", []
        try:
            while not line.endswith(b"\n"):
                part, given, _, _ = socket.recv_fds(
                    self._socket, _ANSWER_PART, 1, socket.MSG_CMSG_CLOEXEC
                )
                line += part
                handles += given
                if not part:
                    break
            result = self._result(line)
            if not handles:
                raise ProtocolViolation(_NO_CONNECTION)
            return result, socket.socket(fileno=handles.pop())
        except OSError as error:
            raise _unreachable(self._path, error) from error
        finally:
            for handle in handles:
                os.close(handle)

    def follow(self, verb: str, **arguments: Any) -> Iterator[Any]:
        """Send one request and yield results until the caller has enough: it then hangs up, or
        asks something else. Raises `HostUnreachable` when the daemon goes away meanwhile."""
        self._send(verb, arguments)
        while True:
            yield self.answer()

    def close(self) -> None:
        """Hang up."""
        self._lines.close()
        self._socket.close()

    def __enter__(self) -> ControlClient:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _send(self, verb: str, arguments: dict[str, Any]) -> None:
        try:
            self._socket.sendall(protocol.encode_request(protocol.Request(verb, arguments)))
        except OSError as error:
            raise _unreachable(self._path, error) from error

    def answer(self) -> Any:
        """The next answer to what was asked. Raises as `ask` does."""
        try:
            line = self._lines.readline()
        except OSError as error:
            raise _unreachable(self._path, error) from error
        return self._result(line)

    def _result(self, line: bytes) -> Any:
        if not line.endswith(b"\n"):  # nothing, or what was left of an answer
            raise _unreachable(self._path, ConnectionResetError("the daemon hung up"))
        result, problems = protocol.decode_answer(line)
        if problems:
            kind = GoalRefused if problems[0].code.startswith("GOAL_") else NondumError
            raise kind(*problems)
        return result


def _unreachable(path: Path, error: OSError) -> HostUnreachable:
    return HostUnreachable(
        Problem(
            "HOST_UNREACHABLE",
            f"no daemon answers ({error})",
            where=str(path),
            fix="start one with `nondum host run --user`, or name its socket with --control",
        )
    )
