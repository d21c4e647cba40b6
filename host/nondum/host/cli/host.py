"""Commands that run the daemon."""

from __future__ import annotations

import asyncio
import dataclasses
import faulthandler
import logging
from pathlib import Path

import click

from nondum.host import config as host_config
from nondum.host.config import HostConfig


@click.group()
def host() -> None:
    """Run the daemon.

    Example: nondum host run --user
    """


@host.command()
@click.option("--user", is_flag=True, help="As this user: no root, no systemd, own state.")
@click.option(
    "--config",
    "config_file",
    type=click.Path(path_type=Path),
    help=f"Configuration file [default: {host_config.SYSTEM_FILE}, none with --user].",
)
@click.option("--name", help="The host's name, over the configuration's.")
@click.option(
    "--peer",
    "peers",
    multiple=True,
    metavar="HOST[:PORT]",
    help="Look for this host, too, where multicast does not reach; may be repeated.",
)
@click.option("--verbose", "-v", is_flag=True, help="Log more.")
def run(
    user: bool, config_file: Path | None, name: str | None, peers: tuple[str, ...], verbose: bool
) -> None:
    """Run a host until it is told to stop (SIGTERM, or Ctrl-C).

    \b
    Examples: nondum host run --user
              nondum host run --config /etc/nondum/host.toml
              nondum host run --user --peer 10.0.0.7
    """
    _log(logging.DEBUG if verbose else logging.INFO)
    chosen = _config(config_file, is_user=user)
    if name is not None:
        host_config.check_name(name, where="--name")
        chosen = dataclasses.replace(chosen, host=dataclasses.replace(chosen.host, name=name))
    if peers:
        section = dataclasses.replace(
            chosen.peers, enabled=True, static=(*chosen.peers.static, *peers)
        )
        chosen = dataclasses.replace(chosen, peers=section)
    from nondum.host.app import run_host

    asyncio.run(run_host(chosen))


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


def _config(config_file: Path | None, *, is_user: bool) -> HostConfig:
    defaults = host_config.user_config() if is_user else HostConfig()
    if config_file is not None:
        return host_config.load(config_file, defaults)
    if not is_user and host_config.SYSTEM_FILE.exists():
        return host_config.load(host_config.SYSTEM_FILE, defaults)
    return defaults
