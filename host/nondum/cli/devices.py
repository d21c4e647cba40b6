"""`nondum devices`: what is plugged in, who has it, and why."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.cli import failure, render
from nondum.cli.advise import wheelhouse_option
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.cli.table import cell, table
from nondum.sdk.errors import ConfigRefused, Problem

if TYPE_CHECKING:
    from nondum.host.sources.devices.drivers import Driver

Row = dict[str, Any]


@click.command()
@click.argument("device", required=False)
@click.option("--why", is_flag=True, help="Tell which rules were asked, and which matched.")
@click.option("--all", "with_gone", is_flag=True, help="Show what was here once, as well.")
@wheelhouse_option
@json_option
@click.pass_obj
def devices(
    session: Session, device: str | None, why: bool, with_gone: bool, wheelhouses: tuple[Path, ...]
) -> None:
    """What is plugged in, and who has it.

    One row is one device as people plug it in, with all its nodes. DEVICE is its name in the first
    column, its port or one of its nodes. For a device that no component uses, the payloads that
    would use it are shown: those that were here before, are on a drive, or in the folders given.

    \b
    Examples: nondum devices
              nondum devices --why usb:1-4.2
              nondum devices --wheelhouse /media/usb --json
    """
    rows: list[Row] = session.ask("devices_why" if why else "devices")
    if device is not None:
        rows = _meant(rows, device)
    drivers = _drivers(session, rows, wheelhouses)
    rows = [
        {**row, "drivers": [_driver_row(d) for d in drivers.get(row["device"], ())]} for row in rows
    ]
    gone = session.ask("known_devices") if with_gone else []
    here = {row["identity"] for row in rows if "identity" in row}
    gone = [row for row in gone if row["identity"] not in here]
    if session.as_json:
        render.as_json({"devices": rows, "gone": gone} if with_gone else rows)
    elif why:
        for row in rows:
            _tell_why(row)
        if not rows:
            click.echo("no devices")
    else:
        _show(rows, drivers)
    if session.as_json:
        return
    for problem in session.ask("device_slots"):
        failure.tell_problem(Problem(**problem), as_warning=True)
    if gone:
        _show_gone(gone)


def _meant(rows: list[Row], wanted: str) -> list[Row]:
    """The devices of that name, port, node or identity. Raises `ConfigRefused` (DEVICE_UNKNOWN)."""
    found = [row for row in rows if wanted in _names(row)]
    if found:
        return found
    known = ", ".join(row["device"] for row in rows) or "none"
    message = f"there is no device {wanted!r}"
    raise ConfigRefused(Problem("DEVICE_UNKNOWN", message, fix=f"there is: {known}"))


def _names(row: Row) -> set[str]:
    nodes = [node["node"] for node in row["nodes"]]
    short = [node.rpartition("/")[2] for node in nodes]
    return {row["device"], row.get("port", ""), row.get("serial", ""), *nodes, *short} - {""}


def _drivers(
    session: Session, rows: Iterable[Row], wheelhouses: Iterable[Path]
) -> dict[str, tuple[Driver, ...]]:
    """Device → the known payloads that would use it, for devices that no component uses."""
    unused = [row for row in rows if not row["component"] and row["nodes"]]
    if not unused:
        return {}
    from nondum.cli.counsel import remembered, seen_of, waiting
    from nondum.cli.shelf import Shelved, distinct, on_shelf
    from nondum.host.sources.devices.drivers import drivers_of
    from nondum.host.sources.devices.view import device_of

    told = session.ask("composition")
    found = [thing for folder in wheelhouses for thing in on_shelf(folder, None)]
    found += waiting(told, None)
    known = [thing for thing in found if isinstance(thing, Shelved)]
    known += remembered(seen_of(row, told["host"]) for row in told["seen"])
    payloads = distinct(known)
    return {row["device"]: drivers_of(device_of(row), payloads) for row in unused}


def _driver_row(driver: Driver) -> Row:
    """A payload that would use a device, as data."""
    return {field.name: getattr(driver, field.name) for field in fields(driver)}


def _show(rows: list[Row], drivers: dict[str, tuple[Driver, ...]]) -> None:
    shown = [
        {
            **row,
            "driver": row.get("driver", ""),
            "nodes": [node["node"] for node in row["nodes"]],
            "used by": _used_by(row),
        }
        for row in rows
    ]
    table(shown, ["device", "name", "driver", "nodes", "used by"], empty="no devices")
    for row in rows:
        for driver in drivers.get(row["device"], ()):
            name = cell(row["name"] or row["device"])
            render.sentence(f"{row['device']}: nothing here drives {name}; {driver} would")


def _used_by(row: Row) -> str:
    if row["left_alone"]:
        return f"left alone: {row['left_alone']}"
    who = row["component"] or "no component"
    if row.get("used_by"):
        who = ", ".join(f"{one['component']} ({one['need']})" for one in row["used_by"])
    others = row["contested_by"]
    return f"{who}; wanted by {', '.join(others)} too" if others else who


def _show_gone(gone: list[Row]) -> None:
    click.echo()
    shown = [
        {**row, "port": row["device"], "last seen": render.clock(row["last_s"])} for row in gone
    ]
    table(shown, ["identity", "name", "port", "last seen"], empty="")


def _tell_why(row: Row) -> None:
    """A device, what is known of it, and how each need fared with it."""
    click.secho(f"{row['device']}  {cell(row['name'])}", bold=True)
    known = {
        "identity": row["identity"],
        "plugged into": row["parent"],
        "driver": row["driver"],
        "interfaces": [_interface(one) for one in row["interfaces"]],
        "nodes": [node["node"] for node in row["nodes"]],
        "here since": f"{render.clock(row['since_s'])} (first {render.clock(row['first_s'])})",
        "used by": _used_by(row),
    }
    for name, value in known.items():
        if value:
            render.sentence(f"  {name}: {cell(value)}")
    for asked in row["asked"]:
        render.sentence(f"  {asked['component']} ({asked['need']}): {asked['outcome']}")
        for node in asked["nodes"]:
            _tell_trial(node)
    if not row["asked"]:
        click.echo("  no component asks for devices")
    for driver in row["drivers"]:
        where = f"{driver['payload']} {driver['version']} ({driver['where']})"
        render.sentence(f"  {where} would use it: {driver['component']} ({driver['need']})")


def _interface(one: Row) -> str:
    return f"{one['number']} {one['kind']} {one['driver'] or 'without driver'}"


def _tell_trial(node: Row) -> None:
    """One node: every rule with what it found."""
    mark = "✓" if node["serves"] else "✗"
    kept = f"  — {node['kept_back']}" if node["kept_back"] else ""
    render.sentence(f"    {mark} {node['node']}{kept}")
    for rule in node["rules"]:
        sign = "✓" if rule["matched"] else "✗"
        found = cell(rule["found"]) if rule["found"] else "nothing"
        render.sentence(f"        {sign} {rule['key']} = {rule['pattern']}: {found}")
