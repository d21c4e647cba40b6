"""Commands that make a running host do something."""

from __future__ import annotations

import sys
from typing import Any

import click

from nondum.cli import complete, render
from nondum.cli.connection import json_option
from nondum.cli.failure import EXIT_REFUSED
from nondum.cli.session import Session
from nondum.host.people.replaced import replacing
from nondum.sdk.errors import GoalRefused, Problem

_NOT_HAD = ("suspended", "halted", "unknown")
"""States of a goal that is not had as things are; of a peer that is gone, it is unknown."""
_TRIPLE = (float, float, float)


@click.command()
@click.argument("words", nargs=-1, shell_complete=complete.goal_words)
@click.option("--pddl", metavar="GOAL", help="The goal as PDDL, for example (found person self).")
@click.option(
    "--maintain",
    "kind",
    flag_value="maintain",
    help="With --pddl: keep it true instead of reaching it.",
)
@click.option(
    "--do", "kind", flag_value="do", help="With --pddl: do it again, even if it was done before."
)
@click.option(
    "--priority",
    default=0,
    show_default=True,
    type=click.IntRange(-1000, 1000),
    help="Higher goes first.",
)
@click.option("--yes", is_flag=True, help="Take courtesies and translations without asking.")
@click.option("--wait", is_flag=True, help="Until it is reached, is held, or has no plan.")
@click.option("--keep", is_flag=True, help="Keep words that mean nothing yet until they do.")
@click.option(
    "--resume",
    "resumed",
    metavar="ID",
    shell_complete=complete.halted_ids,
    help="Take up a goal again that was halted.",
)
@json_option
@click.pass_obj
def goal(
    session: Session,
    words: tuple[str, ...],
    pddl: str | None,
    kind: str | None,
    priority: int,
    yes: bool,
    wait: bool,
    keep: bool,
    resumed: str | None,
) -> int:
    """Give the robot a goal, in words or in PDDL.

    `nondum goals` says which words are understood now. Others may be nearly one of these, or be
    translated by a component: what was understood is shown, and given only once it is confirmed.
    Words that a peer can have and this host cannot, or that begin with its name, are given to the
    peer.

    A goal to maintain, such as "follow me", replaces older ones to maintain of the same or a lower
    priority, if their plans need the same: which ones is shown. Of JSON, they are `replaces`.

    Words that mean nothing yet, since their payload is still being installed, are kept with --keep
    and given once they do; with --wait, while anything is being installed. With --wait, exits with
    1 when there is no plan; the goal then waits for what is missing, until it is halted.

    \b
    Examples: nondum goal follow me through the facility
              nondum goal --pddl "(reported person self)" --wait
              nondum goal alpha, follow me
              nondum goal --resume 3
    """
    if resumed is not None:
        if words or pddl is not None:
            raise click.UsageError("--resume takes up a goal that was given: give no other")
        return _shown(session, session.ask("resume", id=resumed), wait=wait)
    _check_form(words, pddl, kind, keep=keep)
    said = " ".join(words) or None
    form = {"words": said, "pddl": pddl, "kind": kind, "priority": priority}
    given = session.ask("goal", timeout_s=None, **form, yes=yes, keep=keep, wait=wait)
    return _told(session, said or "", given, priority, wait=wait)


def _check_form(words: tuple[str, ...], pddl: str | None, kind: str | None, *, keep: bool) -> None:
    """Raise `click.UsageError` where options do not go together."""
    if bool(words) == (pddl is not None):
        raise click.UsageError("give the goal in words, or with --pddl")
    if kind and pddl is None:
        raise click.UsageError(f"--{kind} is of use with --pddl only: words say it themselves")
    if keep and pddl is not None:
        raise click.UsageError("--keep is of use with words only")


def _told(session: Session, said: str, given: dict[str, Any], priority: int, *, wait: bool) -> int:
    """Show what became of it: a stop, an answer, or a goal, which is given once it is confirmed."""
    if "stopped" in given:
        _show_stopped(session, given["stopped"])
        return 0
    if "answer" in given:
        _show_answer(session, given)
        return 0
    if "id" not in given:
        given = _confirmed(session, said, given, priority)
    elif "understood" in given and not session.as_json:
        render.sentence(_understood(given["understood"]))
    return _shown(session, given, wait=wait)


def _shown(session: Session, given: dict[str, Any], *, wait: bool) -> int:
    if wait:
        given = _settled(session, given)
    if session.as_json:
        render.as_json(given)
    else:
        _show_goal(given)
    return EXIT_REFUSED if given["state"] in _NOT_HAD else 0


@click.command()
@click.argument("words", nargs=-1, required=True, shell_complete=complete.goal_words)
@json_option
@click.pass_obj
def say(session: Session, words: tuple[str, ...]) -> None:
    """Say something to the robot, as if it had heard it.

    It answers "what can you do", "what are you doing", "why not", "what happened", "who is here"
    and "what can I pull", also where nothing is plugged in, and has a peer answer that is named
    first. "Stop" stops it; all else is a goal, for it or for the one peer that can have it. What it
    answers is spoken, too, where something speaks.

    \b
    Examples: nondum say what can you do
              nondum say "why can't you follow me?"
              nondum say "scout, what are you doing"
    """
    _show_answer(session, session.ask("say", timeout_s=None, words=" ".join(words)))


def _show_answer(session: Session, given: dict[str, Any]) -> None:
    if session.as_json:
        render.as_json(given)
    else:
        render.sentence(given["answer"])


def _confirmed(
    session: Session, said: str, answer: dict[str, Any], priority: int
) -> dict[str, Any]:
    """Ask the person whether they were understood, and give just that goal."""
    understood = answer["understood"]
    if session.as_json or not sys.stdin.isatty():
        fix = "give --yes to take it so, or the goal with --pddl"
        raise GoalRefused(Problem("TRANSLATION_UNCONFIRMED", _understood(understood), fix=fix))
    render.sentence(_understood(understood))
    render.sentence(answer["would"]["said"])
    if not click.confirm("Is that what is wanted?"):
        raise GoalRefused(Problem("TRANSLATION_UNCONFIRMED", "nothing was asked for", where=said))
    goal, kind = understood["goal"], understood["kind"]
    given: dict[str, Any] = session.ask("goal", pddl=goal, kind=kind, priority=priority, said=said)
    return given


def _understood(understood: dict[str, Any]) -> str:
    by = " and ".join(understood["by"])
    words = f'"{understood["words"]}": ' if understood["words"] else ""
    return f"understood by {by} as {words}{understood['kind']} {understood['goal']}"


def _settled(session: Session, given: dict[str, Any]) -> dict[str, Any]:
    latest = given
    for latest in session.follow("follow_goal", id=given["id"], host=given.get("host")):
        if latest["holds"] or latest["state"] in _NOT_HAD:
            break
    return latest


def _show_goal(given: dict[str, Any]) -> None:
    of = f" of {given['host']}" if given.get("is_elsewhere") else ""
    goal = given["goal"] or given["text"]
    line = f"goal {given['id']}{of}  {goal}  {given['state']}  {given['reason']}"
    render.sentence(line.rstrip())
    for problem in given["problems"]:
        fix = f" → {problem['fix']}" if problem.get("fix") else ""
        render.sentence(f"{problem['code']} {problem['message']}{fix}", colour="red", mark="  ")
    if told := replacing(given["replaces"]):
        render.sentence(told, mark="  ")


@click.command()
@click.option("--now", is_flag=True, help="Everything that runs, at once, without the planner.")
@click.option(
    "--goal",
    "goal_id",
    metavar="ID",
    shell_complete=complete.goal_ids,
    help="Only this goal, not all.",
)
@json_option
@click.pass_obj
def halt(session: Session, now: bool, goal_id: str | None) -> None:
    """Halt what the robot is doing.

    All goals are given up, and what runs for them ends. With --now, everything else that runs is
    halted too.

    \b
    Examples: nondum halt --now
              nondum halt --goal 3
    """
    _show_stopped(session, session.ask("halt", now=now, id=goal_id))


@click.command()
@json_option
@click.pass_obj
def stop(session: Session) -> None:
    """Stop this host and its peers at once.

    All goals are given up, all behaviours halted. The same as `nondum goal stop`, and as saying
    "stop" to it. Peers stop as well, for who says stop may not know who acts; `nondum halt --now`
    halts this host alone. Software is no emergency stop: see docs/stopping.md.

    Example: nondum stop
    """
    _show_stopped(session, session.stop())


def _show_stopped(session: Session, halted: dict[str, Any]) -> None:
    if session.as_json:
        render.as_json(halted)
        return
    for goal in halted["goals"]:
        click.echo(f"goal {goal} is halted")
    for behaviour in session.short(halted["halted"]):
        render.sentence(behaviour, mark="halting ")
    for peer in halted["peers"]:
        click.echo(f"{peer} has stopped")
    if not any(halted[what] for what in ("goals", "halted", "peers")):
        click.echo("nothing was asked for, nothing was running")


@click.command()
@click.argument("unit", shell_complete=complete.units)
@click.option("--xyz", type=_TRIPLE, metavar="X Y Z", help="Metres from the body's frame.")
@click.option("--rpy", type=_TRIPLE, metavar="ROLL PITCH YAW", help="Radians.")
@json_option
@click.pass_obj
def mount(
    session: Session,
    unit: str,
    xyz: tuple[float, float, float] | None,
    rpy: tuple[float, float, float] | None,
) -> None:
    """Tell where on the body a unit is mounted.

    Axes follow REP-103: x forward, y left, z up; roll, pitch and yaw turn about them in that order.
    What is not given stays as it was. `nondum units` shows units and their poses.

    Example: nondum mount panther__turret__head --xyz 0.1 0 0.4 --rpy 0 0 1.57
    """
    if xyz is None and rpy is None:
        raise click.UsageError("say where: --xyz X Y Z, --rpy ROLL PITCH YAW, or both")
    mounted = session.ask("mount", unit=unit, xyz=xyz, rpy=rpy)
    if session.as_json:
        render.as_json(mounted)
        return
    xyz_said, rpy_said = (" ".join(f"{v:g}" for v in mounted[key]) for key in ("xyz", "rpy"))
    click.echo(f"{mounted['unit']} is mounted at xyz {xyz_said}, rpy {rpy_said}")
    for warning in mounted["warnings"]:
        click.secho(f"warning: {warning}", fg="yellow", err=True)


@click.command()
@click.argument("name", metavar="PAYLOAD", shell_complete=complete.troubled)
@json_option
@click.pass_obj
def retry(session: Session, name: str) -> None:
    """Try again what was refused or quarantined.

    PAYLOAD is a payload's id, or a component of it.

    Example: nondum retry org.example.window-opener
    """
    retried = session.ask("retry", name=name)
    if session.as_json:
        render.as_json(retried)
        return
    for payload in retried["payloads"]:
        click.echo(f"{payload} is tried again: see `nondum status --follow`")
