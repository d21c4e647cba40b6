"""`nondum doctor disks`: which disks are whose."""

from __future__ import annotations

from typing import Any

import click

from nondum.cli import render
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.cli.table import table


@click.command()
@json_option
@click.pass_obj
def disks(session: Session) -> None:
    """Tell which disks this host reads as drives, and which it leaves alone, and why.

    Run it as root for all there is to know: `/etc/crypttab` may be for root only.

    Example: nondum doctor disks
    """
    from nondum.host.sandbox.helper.block_devices import Machine
    from nondum.host.sandbox.helper.client import MOUNTS
    from nondum.host.sources.drives.disk_report import disks as all_disks

    rows: list[dict[str, Any]] = [
        {
            "disk": disk.name,
            "size": disk.size,
            "usb": disk.is_usb,
            "whose": disk.owner.value,
            "why": disk.why,
        }
        for disk in all_disks(Machine(), MOUNTS)
    ]
    if session.as_json:
        render.as_json(rows)
        return
    shown = [{**row, "size": render.size(row["size"])} for row in rows]
    table(shown, ["disk", "size", "usb", "whose", "why"], empty="There are no disks.")
