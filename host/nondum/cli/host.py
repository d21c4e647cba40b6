"""Commands that run the daemon."""

from __future__ import annotations

import asyncio
import faulthandler
import logging
import os
from pathlib import Path

import click

from nondum.cli import render
from nondum.cli.config import asked_options
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.host.config.effective import Asked, effective
from nondum.host.core.records.safety import Safety
from nondum.host.service.notify import Notifier

LONGEST_IMPORT_S = 300.0
"""What a slow machine may take until all of nondum is imported."""


@click.group()
def host() -> None:
    """Run the daemon.

    Example: nondum host run --user
    """


@host.command()
@asked_options
@click.option(
    "--safe",
    type=click.Choice([Safety.INITIAL.value, Safety.NOTHING.value]),
    is_flag=False,
    flag_value=Safety.INITIAL.value,
    help="Safe mode: only what was installed for good may be at work, or nothing.",
)
@click.option("--verbose", "-v", is_flag=True, help="Log more.")
def run(
    user: bool,
    config_file: Path | None,
    name: str | None,
    peers: tuple[str, ...],
    safe: str | None,
    verbose: bool,
) -> None:
    """Run a host until it is told to stop (SIGTERM, or Ctrl-C).

    \b
    Examples: nondum host run --user
              nondum host run --config /etc/nondum/host.toml
              nondum host run --user --peer 10.0.0.7
              nondum host run --safe
    """
    _log(logging.DEBUG if verbose else logging.INFO)
    chosen = effective(Asked(user, config_file, name, peers))
    notifier = Notifier.from_environment(os.environ)
    notifier.starting(LONGEST_IMPORT_S)
    from nondum.host.app import run_host

    safety = Safety(safe) if safe else Safety.OFF
    asyncio.run(run_host(chosen, safety=safety, notifier=notifier))


@host.command()
@click.option(
    "--all",
    "brings_all",
    is_flag=True,
    help="Also try again every payload that was refused or quarantined, in safe mode or not.",
)
@json_option
@click.pass_obj
def resume(session: Session, brings_all: bool) -> None:
    """Leave safe mode: take in again the drives and payloads that were left alone.

    Example: nondum host resume --all
    """
    answer = session.ask("leave_safe_mode", **({"all": True} if brings_all else {}))
    if session.as_json:
        render.as_json(answer)
        return
    if answer["was"] != "off":
        click.echo("safe mode is left; `nondum status` shows what comes")
    if brings_all:
        tried = ", ".join(answer["payloads"])
        click.echo(f"tried again: {tried}" if tried else "there is nothing to try again")


def _log(level: int) -> None:
    """To systemd's journal with all its fields, where standard error is that, else as text there.

    What hangs until systemd ends it (SIGABRT) says first where it was.
    """
    from nondum.host.service import journal

    faulthandler.enable()
    if journal.is_in_use():
        logging.basicConfig(level=level, format="%(message)s", handlers=[journal.JournalHandler()])
    else:
        logging.basicConfig(level=level, format="%(levelname)s %(name)s: %(message)s")
