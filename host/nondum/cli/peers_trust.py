"""Commands about the trust and the identity of a running host."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from nondum.cli import complete, failure, render
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.cli.table import table
from nondum.sdk.errors import HostUnreachable, NondumError, Problem

MOST_BYTES = 4096
FILE = click.Path(path_type=Path, exists=True, dir_okay=False)


@click.command()
@json_option
@click.pass_obj
def trust(session: Session) -> None:
    """The hosts that this host lets in, those that it does not, and its own identity.

    Example: nondum peers trust
    """
    view = session.ask("peers_trust")
    if session.as_json:
        render.as_json(view)
        return
    click.echo(f"this host is {view['name']}  {view['fingerprint']}")
    render.sentence(_certified(view["certificate"]))
    for problem in view["warnings"]:
        failure.tell_problem(Problem(**problem), as_warning=True)
    click.echo()
    rows = [
        {**row, "trusted": kind}
        for kind, key in (("fleet", "fleets"), ("paired", "paired"), ("revoked", "revoked"))
        for row in view[key]
    ]
    columns = ["trusted", "name", "fingerprint", *(["why"] if view["revoked"] else [])]
    table(rows, columns, empty="no host is trusted yet: see `nondum peers pair --help`")


def _certified(row: dict[str, Any] | None) -> str:
    if row is None:
        return "no fleet has certified it"
    fleet = row["fleet"] or f"a fleet that it does not trust itself ({row['fleet_fingerprint']})"
    return f"certified by {fleet} until {row['not_after']}"


@click.command()
@click.argument("who", metavar="HOST", shell_complete=complete.trusted)
@click.option("--why", required=True, help="The reason, shown to people, for example: stolen.")
@json_option
@click.pass_obj
def revoke(session: Session, who: str, why: str) -> None:
    """Never let a host in again, however it was let in before.

    HOST is a name, a fingerprint or a whole key. A link to it is cut at once. Other hosts are to be
    told one by one. It can be undone: `nondum peers forget FINGERPRINT`.

    Example: nondum peers revoke rover-2 --why "stolen in the field"
    """
    row = session.ask("peers_revoke", who=who, why=why)
    if session.as_json:
        render.as_json(row)
    else:
        render.sentence(f"revoked: {_called(row)}")


@click.command()
@click.argument("who", metavar="HOST", shell_complete=complete.trusted)
@json_option
@click.pass_obj
def forget(session: Session, who: str) -> None:
    """Forget a paired host or a fleet, or that a key was revoked.

    HOST is a name, a fingerprint or a whole key. What was forgotten may be trusted again.

    Example: nondum peers forget rover-2
    """
    row = session.ask("peers_forget", who=who)
    if session.as_json:
        render.as_json(row)
    else:
        render.sentence(f"forgotten: the {row['kind']} {_called(row)}")


@click.command()
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help="File to write it to, for `nondum keys fleet sign`.",
)
@json_option
@click.pass_obj
def key(session: Session, output: Path | None) -> None:
    """This host's public key and its fingerprint. Neither is secret.

    \b
    Examples: nondum peers key
              nondum peers key -o /media/usb/rover.pub
    """
    row = session.ask("peers_key")
    if output is not None:
        output.write_text(row["public"], encoding="ascii")
    if session.as_json:
        render.as_json(row)
        return
    click.echo(row["public"], nl=False)
    click.echo(f"fingerprint {row['fingerprint']}")


@click.command()
@click.argument("file", type=FILE)
@json_option
@click.pass_obj
def certify(session: Session, file: Path) -> None:
    """Show peers this certificate from now on: hosts that trust its fleet let this one in.

    This host lets no other host in by it.

    Example: nondum peers certify /media/usb/nondum-peers/certificate
    """
    with _about(file):
        row = session.ask("peers_certify", certificate=_text(file))
    if session.as_json:
        render.as_json(row)
        return
    render.sentence(f"{row['host']} is {_certified(row)}")
    if not row["is_trusted"]:
        told = "hosts of that fleet let this one in, and it does not let them in"
        failure.tell_problem(
            Problem("FLEET_UNTRUSTED", told, fix="nondum peers trust-fleet FILE"), as_warning=True
        )


@click.command("trust-fleet")
@click.argument("file", type=FILE)
@click.option("--name", help="What to call the fleet here [default: as its owner does].")
@json_option
@click.pass_obj
def trust_fleet(session: Session, file: Path, name: str | None) -> None:
    """Let in every host that a fleet certifies.

    FILE is the fleet's public file, `fleet.pub`. Compare the fingerprint with the owner's.

    Example: nondum peers trust-fleet /media/usb/nondum-peers/fleet.pub --name survey
    """
    with _about(file):
        row = session.ask("peers_trust_fleet", fleet=_text(file), name=name)
    if session.as_json:
        render.as_json(row)
    else:
        render.sentence(f"trusted: the fleet {_called(row)}")


def _called(row: dict[str, Any]) -> str:
    return f"{row['name']}  {row['fingerprint']}".strip()


def _text(file: Path) -> str:
    with file.open("rb") as stream:
        return stream.read(MOST_BYTES).decode("ascii", "replace")


@contextmanager
def _about(file: Path) -> Iterator[None]:
    """Say in every refusal which file it is about."""
    try:
        yield
    except HostUnreachable:
        raise
    except NondumError as error:
        where = (f"{file}: {p.where}" if p.where else str(file) for p in error.problems)
        told = (replace(p, where=w) for p, w in zip(error.problems, where, strict=True))
        raise type(error)(*told) from error
