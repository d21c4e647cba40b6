"""Commands about keys: who may sign payloads, and which hosts a fleet lets in."""

from __future__ import annotations

import click

from nondum.cli.keys_fleet import fleet
from nondum.cli.keys_host import list_keys, trust
from nondum.cli.keys_owner import allow, init, new, revoke, rotate, sign


@click.group()
def keys() -> None:
    """Whose payloads robots run, and which hosts a fleet certifies.

    An owner keeps a trust file, signs it with root keys, and brings it to robots on a drive, in
    nondum-trust/; each robot is given the first one by hand.

    \b
    Example: nondum keys new alice
             nondum keys init trust.toml --owner survey --root alice.pub
             nondum keys sign trust.toml --key alice
             nondum keys trust trust.toml
    """


for command in (allow, fleet, init, list_keys, new, revoke, rotate, sign, trust):
    keys.add_command(command)
