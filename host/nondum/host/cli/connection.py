"""Which daemon a command talks to, and the options all commands of that kind share."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from nondum.host.control.client import ControlClient

_F = TypeVar("_F", bound=Callable[..., Any])

SYSTEM_CONTROL = Path("/run/nondum/control.sock")


def user_control() -> Path:
    """The control socket of a host run with `--user`."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    base = Path(runtime) if runtime else Path.home() / ".local/state"
    return base / "nondum/control.sock"


def connect(control: Path | None, *, timeout_s: float | None = 30.0) -> ControlClient:
    """Connect to the daemon named, else to this user's, else to the system's.

    Raises `HostUnreachable` when none answers.
    """
    if control is None:
        control = user_control() if user_control().exists() else SYSTEM_CONTROL
    return ControlClient(control, timeout_s=timeout_s)


def json_option(command: _F) -> _F:
    """Add `--json`."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON for machines.")(command)
