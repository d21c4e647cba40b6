"""Other hosts: who is here, and whom this host trusts."""

from __future__ import annotations

import click

from nondum.host.cli import peers_pair, peers_trust, render
from nondum.host.cli.connection import Session, json_option
from nondum.host.cli.table import table


@click.group(invoke_without_command=True)
@json_option
@click.pass_context
def peers(ctx: click.Context) -> None:
    """Other hosts: who is here, and whom this host trusts.

    \b
    Examples: nondum peers
              nondum peers pair
    """
    if ctx.invoked_subcommand is None:
        show(ctx.obj)


def show(session: Session) -> None:
    """Print who is here."""
    rows = session.ask("peers")
    if session.as_json:
        render.as_json(rows)
    else:
        table(rows, ["peer", "fingerprint", "address"], empty="no peers")


for command in (
    peers_pair.pair,
    peers_trust.trust,
    peers_trust.revoke,
    peers_trust.forget,
    peers_trust.key,
    peers_trust.certify,
    peers_trust.trust_fleet,
):
    peers.add_command(command)
