"""Commands that make a running host do something."""

from __future__ import annotations

from typing import Any

import click

from nondum.host.cli import render
from nondum.host.cli.connection import connect, json_option
from nondum.host.cli.failure import EXIT_REFUSED
from nondum.host.control.client import ControlClient

FINAL = {"reached", "failed", "halted", "refused"}


@click.command()
@click.argument("words", required=False)
@click.option("--pddl", metavar="GOAL", help="The goal as PDDL, for example (found person self).")
@click.option("--maintain", is_flag=True, help="With --pddl: keep it true instead of reaching it.")
@click.option("--priority", default=0, show_default=True, help="Higher goes first.")
@click.option("--wait", is_flag=True, help="Until the goal is reached or has failed.")
@json_option
@click.pass_context
def goal(
    ctx: click.Context,
    words: str | None,
    pddl: str | None,
    maintain: bool,
    priority: int,
    wait: bool,
    as_json: bool,
) -> int:
    """Give the robot a goal, in words or in PDDL.

    \b
    Examples: nondum goal "follow me through the facility"
              nondum goal --pddl "(reported person self)" --wait
    """
    if (words is None) == (pddl is None):
        raise click.UsageError("give the goal in words, or with --pddl")
    with connect(ctx.obj, timeout_s=None if wait else 30.0) as client:
        given = client.ask(
            "goal",
            words=words,
            pddl=pddl,
            kind="maintain" if maintain else None,
            priority=priority,
        )
        if wait:
            given = _settled(client, given)
    if as_json:
        render.as_json(given)
    else:
        click.echo(f"goal {given['id']}  {given['goal']}  {given['state']}  {given['reason']}")
    return EXIT_REFUSED if given["state"] in FINAL - {"reached"} else 0


def _settled(client: ControlClient, given: dict[str, Any]) -> dict[str, Any]:
    latest = given
    for latest in client.follow("follow_goal", id=given["id"]):
        if latest["state"] in FINAL:
            break
    return latest


@click.command()
@click.option("--now", is_flag=True, help="Everything, at once, without the planner.")
@click.option("--goal", "goal_id", help="Only this goal.")
@json_option
@click.pass_context
def halt(ctx: click.Context, now: bool, goal_id: str | None, as_json: bool) -> None:
    """Halt what the robot is doing.

    Example: nondum halt --now
    """
    with connect(ctx.obj) as client:
        halted = client.ask("halt", now=now, id=goal_id)
    if as_json:
        render.as_json(halted)
    else:
        click.echo("\n".join(halted["halted"]) or "nothing was running")


@click.command()
@click.argument("unit")
@click.option("--xyz", nargs=3, type=float, default=(0.0, 0.0, 0.0), help="Metres from the body.")
@click.option("--rpy", nargs=3, type=float, default=(0.0, 0.0, 0.0), help="Radians.")
@json_option
@click.pass_context
def mount(
    ctx: click.Context,
    unit: str,
    xyz: tuple[float, float, float],
    rpy: tuple[float, float, float],
    as_json: bool,
) -> None:
    """Tell where on the body a unit is mounted.

    Axes follow REP-103: x forward, y left, z up; roll, pitch and yaw turn about them in that order.

    Example: nondum mount panther__turret__head --xyz 0.1 0 0.4 --rpy 0 0 1.57
    """
    with connect(ctx.obj) as client:
        mounted = client.ask("mount", unit=unit, xyz=list(xyz), rpy=list(rpy))
    if as_json:
        render.as_json(mounted)
        return
    click.echo(f"{mounted['unit']} is mounted at xyz {mounted['xyz']}, rpy {mounted['rpy']}")
    for warning in mounted["warnings"]:
        click.secho(f"warning: {warning}", fg="yellow", err=True)
