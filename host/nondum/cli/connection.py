"""Which daemon a command talks to, and what it was told besides its own arguments."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, cast

import click

from nondum.host.control.client import ControlClient
from nondum.host.core.names import all_shortened, has_unknown
from nondum.sdk.errors import HostUnreachable

_Shown = TypeVar("_Shown")
_F = TypeVar("_F", bound=Callable[..., Any])

TIMEOUT_S = 30.0


@dataclass(slots=True)
class Session:
    """One run of the command line; `click` passes it to every command as its `obj`."""

    control: Path | None = None
    as_json: bool = False
    _names: dict[str, str] | None = None

    def connect(self, *, timeout_s: float | None = TIMEOUT_S) -> ControlClient:
        """Connect to the daemon that was named, else to the first of the usual ones that answers.

        Raises `HostUnreachable` when none does, naming a socket that a killed daemon left behind
        rather than one that is not there.
        """
        paths = [self.control] if self.control else list(usual_sockets())
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


def usual_sockets() -> Iterator[Path]:
    """Where daemons listen: this user's, with or without a login session, then the system's."""
    from nondum.host.config import host_config  # only commands that name no socket pay for it

    yield host_config.user_config().host.control
    yield host_config.user_state() / "control.sock"
    yield host_config.HostConfig().host.control


def json_option(command: _F) -> _F:
    """Add `--json`: it is kept in the session, so that refusals are told in JSON too."""
    return click.option(
        "--json",
        "as_json",
        is_flag=True,
        is_eager=True,
        expose_value=False,
        callback=_keep_as_json,
        help="Print JSON for machines.",
    )(command)


def control_option(command: _F) -> _F:
    """Add `--control`."""
    return click.option(
        "--control",
        type=click.Path(path_type=Path),
        envvar="NONDUM_CONTROL",
        expose_value=False,
        callback=_keep_control,
        help="The daemon's control socket [default: this user's, else the system's].",
    )(command)


def _keep_as_json(ctx: click.Context, _: click.Parameter, is_wanted: bool) -> None:
    ctx.ensure_object(Session).as_json |= is_wanted


def _keep_control(ctx: click.Context, _: click.Parameter, path: Path | None) -> None:
    ctx.ensure_object(Session).control = path
