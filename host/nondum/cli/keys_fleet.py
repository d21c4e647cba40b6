"""Commands for the owner of a fleet, on a machine that needs no daemon and no network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from nondum.cli import render
from nondum.cli.connection import json_option
from nondum.cli.session import Session

if TYPE_CHECKING:
    from nondum.transport.peers.public_file import HostPublic

FOLDER = click.Path(path_type=Path, file_okay=False)
MOST_DAYS = 3650
MOST_BYTES = 4096


@click.group()
def fleet() -> None:
    """Make a fleet, and certify its hosts.

    Hosts that trust a fleet let in the hosts that it has certified, without pairing.

    Example: nondum keys fleet sign rover.pub --fleet survey -o /media/usb/nondum-peers/certificate
    """


@fleet.command()
@click.argument("folder", metavar="DIR", type=FOLDER)
@click.option("--name", help="What to call the fleet [default: as the folder].")
@json_option
@click.pass_obj
def new(session: Session, folder: Path, name: str | None) -> None:
    """Make a fleet: a secret key, to be kept off all hosts, and a public one.

    A person who has the secret key can let any host in. Keep DIR on a drive in a drawer.

    Example: nondum keys fleet new /media/drawer/survey
    """
    from nondum.transport.peers import fleet_files
    from nondum.transport.peers.keys import fingerprint

    public = fleet_files.create(folder, name or folder.absolute().name)
    found = fingerprint(public.key)
    if session.as_json:
        render.as_json({"name": public.name, "fingerprint": found, "key": public.key})
        return
    click.echo(f"{folder / fleet_files.SECRET_NAME}  secret")
    click.echo(f"{folder / fleet_files.PUBLIC_NAME}  public: {public.name}  {found}")
    click.echo(f"next, on each host: nondum peers trust-fleet {fleet_files.PUBLIC_NAME}")


@fleet.command()
@click.argument("key")
@click.option("--fleet", "folder", type=FOLDER, default=Path(), help="The fleet [default: here].")
@click.option("--host", help="The host's name [default: as KEY's file says].")
@click.option(
    "--days",
    type=click.IntRange(1, MOST_DAYS),
    default=365,
    show_default=True,
    help="How long it holds.",
)
@click.option(
    "-o",
    "--output",
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    default=Path("certificate"),
    show_default=True,
    help="File to write.",
)
@json_option
@click.pass_obj
def sign(
    session: Session, key: str, folder: Path, host: str | None, days: int, output: Path
) -> None:
    """Certify a host.

    KEY is the file that `nondum peers key -o` wrote there, or the key itself in single quotes. On a
    drive, certificates are found in nondum-peers/, by the name `certificate`, or any name that ends
    in `.certificate`: each host takes its own.

    \b
    Examples: nondum keys fleet sign rover.pub --fleet survey
              nondum keys fleet sign rover.pub --days 30 -o usb/nondum-peers/rover.certificate
    """
    from datetime import UTC, datetime

    from nondum.transport.peers import fleet_files
    from nondum.transport.peers.keys import fingerprint

    public = _host(key, host)
    certificate = fleet_files.sign(folder, public, now=datetime.now(UTC), days=days)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_bytes(certificate.to_bytes())
    until = certificate.not_after.strftime("%F")
    found = fingerprint(public.key)
    if session.as_json:
        told = {"host": public.name, "fingerprint": found, "until": until, "file": str(output)}
        render.as_json(told)
    else:
        click.echo(f"{output}  {public.name}  {found}  until {until}")


def _host(key: str, name: str | None) -> HostPublic:
    """The host that is meant by a file, or by its key and name."""
    from nondum.transport.peers.keys import parse_key
    from nondum.transport.peers.public_file import HostPublic, parse_host

    file = Path(key)
    if not file.is_file():
        if name is None:
            raise click.UsageError(f"{key} is no file; with a key, give the host's name: --host")
        return HostPublic(parse_key(key), name)
    with file.open("rb") as stream:
        found = parse_host(stream.read(MOST_BYTES).decode("ascii", "replace"), key)
    return HostPublic(found.key, name or found.name)
