"""Commands that look for what is wrong around the host. None needs a daemon."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.cli import render
from nondum.cli.connection import json_option
from nondum.cli.doctor_disks import disks
from nondum.cli.failure import EXIT_PROBLEMS
from nondum.cli.session import Session
from nondum.cli.table import table

if TYPE_CHECKING:
    from nondum.host.config.effective import Asked
    from nondum.transport.discovery.doctor import Finding


@click.group(invoke_without_command=True)
@click.option("--user", is_flag=True, help="For `nondum host run --user`.")
@click.option(
    "--config",
    "config_file",
    type=click.Path(path_type=Path),
    help="The configuration to look by [default: the system's, none with --user].",
)
@click.option(
    "--board",
    is_flag=True,
    help="Tell what this machine is instead, as Markdown to paste into an issue; takes seconds.",
)
@json_option
@click.pass_context
def doctor(ctx: click.Context, user: bool, config_file: Path | None, board: bool) -> int | None:
    """Look for what is wrong around this host, without a daemon.

    Without a command, everything is looked at. Exits with 3 when something is bad; what is doubtful
    (`warn`) is told only.

    \b
    Examples: nondum doctor
              nondum doctor --user --json
              nondum doctor --board
              nondum doctor network
    """
    if ctx.invoked_subcommand is not None:
        if board:
            raise click.UsageError("--board has no command behind it", ctx)
        return None
    from nondum.cli.examination.examination import examine
    from nondum.cli.examination.finding import is_well, row
    from nondum.host.config.effective import Asked

    asked = Asked(is_user=user, file=config_file)
    if board:
        return _board(asked, as_json=ctx.obj.as_json)
    found = list(examine(asked))
    rows = [row(finding) for finding in found]
    if ctx.obj.as_json:
        render.as_json({"ok": is_well(found), "findings": rows})
    else:
        table(rows, ["result", "check", "subject", "detail"], empty="Nothing was looked at.")
        for one in rows:
            if one["fix"] and one["result"] != "ok":
                render.sentence(f"{one['subject'] or one['check']}: {one['fix']}", mark="→ ")
    return 0 if is_well(found) else EXIT_PROBLEMS


doctor.add_command(disks)


@doctor.command()
@click.option(
    "--port",
    type=click.IntRange(1, 65_535),
    default=7410,
    show_default=True,
    help="Where this host listens to others (`peers.listen`).",
)
@json_option
@click.pass_obj
def network(session: Session, port: int) -> int:
    """Tell whether this host can find others, and be found. Exits with 3 when it cannot.

    Example: nondum doctor network
    """
    from nondum.transport.discovery.doctor import Result, examine

    found = [_row(finding) for finding in examine(port)]
    is_well = all(row["result"] != Result.BAD.value for row in found)
    if session.as_json:
        render.as_json({"ok": is_well, "findings": found})
    else:
        table(found, ["result", "check", "interface", "detail"], empty="Nothing was looked at.")
        for row in found:
            if row["fix"]:
                render.sentence(f"{row['interface'] or row['check']}: {row['fix']}", mark="→ ")
    return 0 if is_well else EXIT_PROBLEMS


@doctor.command()
@json_option
@click.pass_obj
def confinement(session: Session) -> int:
    """Try out how plugins can be confined here, as this user. Exits with 3 when they cannot.

    Every level is tried by confining a process and having it look around.

    Example: nondum doctor confinement
    """
    from nondum.host.workers import confinement_probe

    rows = [finding.to_dict() for finding in confinement_probe.all_findings()]
    is_well = any(row["available"] for row in rows)
    if session.as_json:
        render.as_json({"ok": is_well, "levels": rows})
    else:
        table(rows, ["level", "mechanism", "available", "reason"], empty="")
        for row in rows:
            if row["fix"]:
                render.sentence(row["fix"], mark=f"→ {row['level']}: ")
    return 0 if is_well else EXIT_PROBLEMS


@doctor.command()
@json_option
@click.pass_obj
def limits(session: Session) -> int:
    """Tell what workers can be limited in here. Exits with 3 when something is missing.

    A service may do more than the person who asks: `nondum status` tells what a running host does.

    Example: nondum doctor limits
    """
    from nondum.host.sandbox.cgroups import Cgroups

    cgroups = Cgroups.open(Path(tempfile.gettempdir()) / f"nondum-doctor-{os.getpid()}")
    problems = cgroups.problems()
    cgroups.close()
    rows = [{"limit": name, "held": name in cgroups.holds} for name in ("memory", "pids", "cpu")]
    if session.as_json:
        told = [problem.to_dict() for problem in problems]
        render.as_json(
            {"ok": not problems, "cgroups": cgroups.kind, "limits": rows, "problems": told}
        )
    else:
        table(rows, ["limit", "held"], empty="")
        for problem in problems:
            render.sentence(str(problem), mark="→ ")
    return EXIT_PROBLEMS if problems else 0


def _board(asked: Asked, *, as_json: bool) -> int:
    from nondum.cli.board.report import markdown, rows
    from nondum.host.config.effective import effective

    told = list(rows(effective(asked)))
    if as_json:
        render.as_json([row.to_dict() for row in told])
    else:
        render.sentence(markdown(told))
    return 0


def _row(finding: Finding) -> dict[str, Any]:
    return {
        "check": finding.check,
        "interface": finding.interface,
        "result": finding.result.value,
        "detail": finding.detail,
        "fix": finding.fix,
    }
