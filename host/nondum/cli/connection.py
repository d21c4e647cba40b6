"""The options by which a person says which daemon is meant, and how answers are shown."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from nondum.cli.session import Session
from nondum.cli.stop_first import CONTROL

_F = TypeVar("_F", bound=Callable[..., Any])


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
        envvar=CONTROL,
        expose_value=False,
        callback=_keep_control,
        help="The daemon's control socket [default: this user's, else the system's].",
    )(command)


def _keep_as_json(ctx: click.Context, _: click.Parameter, is_wanted: bool) -> None:
    ctx.ensure_object(Session).as_json |= is_wanted


def _keep_control(ctx: click.Context, _: click.Parameter, path: Path | None) -> None:
    ctx.ensure_object(Session).control = path
