"""One run of the command line: which daemon it talks to. Imports nothing of click."""

from __future__ import annotations

import socket
from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, cast

from nondum.host.config.control_sockets import usual_sockets
from nondum.host.control.client import ControlClient
from nondum.host.core.names import all_shortened, has_unknown
from nondum.sdk.errors import HostUnreachable

_Shown = TypeVar("_Shown")

TIMEOUT_S = 30.0


@dataclass(slots=True)
class Session:
    """One run of the command line; `click` passes it to every command as its `obj`."""

    control: Path | None = None
    as_json: bool = False
    asked_to_stop: tuple[str, socket.socket] | None = None
    """Where the daemon was asked to stop the robot already, and what its answer comes over."""
    _names: dict[str, str] | None = None

    def stop(self) -> Any:
        """Stop the robot and its peers: what was stopped. Raises `NondumError`."""
        if self.asked_to_stop is None:
            return self.ask("goal", words="stop")["stopped"]
        path, connection = self.asked_to_stop
        with closing(ControlClient(Path(path), connection=connection)) as client:
            return client.answer()["stopped"]

    def connect(self, *, timeout_s: float | None = TIMEOUT_S) -> ControlClient:
        """Connect to the daemon that was named, else to the first of the usual ones that answers.

        Raises `HostUnreachable` when none does, naming a socket that a killed daemon left behind
        rather than one that is not there.
        """
        paths = [self.control] if self.control else [Path(path) for path in usual_sockets()]
        for path in paths:
            try:
                return ControlClient(path, timeout_s=timeout_s)
            except HostUnreachable:
                continue
        left = [path for path in paths if path.exists()]
        return ControlClient((left or paths)[-1], timeout_s=timeout_s)

    def ask(self, verb: str, *, timeout_s: float | None = TIMEOUT_S, **arguments: Any) -> Any:
        """Ask one question. Raises `NondumError` with the refusal."""
        with closing(self.connect(timeout_s=timeout_s)) as client:
            return client.ask(verb, **arguments)

    def short(self, shown: _Shown, *, refresh: bool = False) -> _Shown:
        """Texts, or rows of them, with short names of units and streams; JSON keeps whole ones.
        `refresh`: ask the daemon for the names again if one is shown that is not known yet.

        Raises `NondumError`.
        """
        if self._names is None or (refresh and has_unknown(shown, self._names)):
            self._names = self.ask("names")
        return cast(_Shown, all_shortened(shown, self._names))

    def follow(self, verb: str, **arguments: Any) -> Generator[Any]:
        """Ask for answers until the caller has enough. Raises `NondumError`."""
        with closing(self.connect(timeout_s=None)) as client:
            yield from client.follow(verb, **arguments)
