"""Which payloads would help, and how."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.cli import complete, render
from nondum.cli.connection import json_option
from nondum.cli.failure import tell_problem
from nondum.cli.judge import FOLDER
from nondum.cli.machine import this_machine
from nondum.cli.session import Session
from nondum.cli.table import table
from nondum.sdk.errors import GoalRefused, HostUnreachable, Problem

if TYPE_CHECKING:
    from nondum.cli.counsel import Counsel, Surroundings
    from nondum.planning.explain.advise import Advice, Candidate, Way

EXIT_NOTHING_HELPS = 11
EXIT_UNKNOWN = 12
"""Nothing was found that helps, but not everything could be looked at."""

wheelhouse_option = click.option(
    "--wheelhouse",
    "wheelhouses",
    multiple=True,
    type=FOLDER,
    help="Drive, or folder of payload folders, to look through as well.",
)


@click.command()
@click.argument("goal", nargs=-1, required=True, shell_complete=complete.goal_words)
@wheelhouse_option
@click.option(
    "--host-of",
    "host",
    metavar="NAME",
    help="Ask no daemon: advise for a host of this name with nothing plugged in.",
)
@json_option
@click.pass_obj
def advise(
    session: Session, goal: tuple[str, ...], wheelhouses: tuple[Path, ...], host: str | None
) -> int:
    """Which payloads would make a goal possible, and by which plan.

    GOAL is in words, in PDDL, or the number of one that was given. Known are payloads that were
    here before, that are on drives, and those in the folders given; nothing of them is run. Each
    alternative needs all its payloads; its plan was checked. Exits with 11 if nothing known helps,
    with 12 if that is not certain.

    \b
    Examples: nondum advise follow me
              nondum advise "(pointing self radiation-source)" --wheelhouse /media/usb
    """
    asked = " ".join(goal)
    if host is None:
        asked = without_number(session, asked)
    around, problems = surroundings(session, wheelhouses, host)
    for problem in problems if not session.as_json else ():
        tell_problem(problem, as_warning=True)
    found = around.counsel(asked)
    if session.as_json:
        render.as_json({**row(found), "unread": [problem.to_dict() for problem in problems]})
    else:
        show(found)
    return exit_code(found)


def without_number(session: Session, asked: str) -> str:
    """The goal in PDDL where its number is given. Raises `GoalRefused` (GOAL_UNKNOWN)."""
    if not asked.isdecimal():
        return asked
    given = {row["id"]: str(row["goal"] or row["text"]) for row in session.ask("status")["goals"]}
    if asked not in given:
        known = ", ".join(given) or "none was given"
        message = f"there is no goal {asked!r}"
        raise GoalRefused(Problem("GOAL_UNKNOWN", message, fix=f"goals: {known}"))
    return given[asked]


def surroundings(
    session: Session, wheelhouses: Iterable[Path], host: str | None = None
) -> tuple[Surroundings, list[Problem]]:
    """The daemon's host with all payloads that are known of, and what could not be read of them.

    A bare host where one is named. Raises `HostUnreachable`.
    """
    from nondum.cli.counsel import Surroundings, waiting
    from nondum.cli.shelf import Shelved, on_shelf

    facts = this_machine(session)
    told = None if host else _told(session)
    shelf: list[Shelved] = []
    problems: list[Problem] = []
    found = [found for folder in wheelhouses for found in on_shelf(folder, facts)]
    for thing in [*found, *(waiting(told, facts) if told else ())]:
        if isinstance(thing, Shelved):
            shelf.append(thing)
        else:
            problems.append(thing)
    if told is None:
        return Surroundings.bare(host or "", shelf), problems
    return Surroundings.of(told, shelf), problems


def _told(session: Session) -> Any:
    try:
        return session.ask("composition")
    except HostUnreachable as error:
        fix = "start it, or give --host-of NAME to ask without one"
        first = error.problems[0]
        raise HostUnreachable(Problem(first.code, first.message, first.where, fix=fix)) from error


def exit_code(found: Counsel) -> int:
    """What a script is told."""
    if found.advice.helps:
        return 0
    return EXIT_NOTHING_HELPS if found.advice.is_complete else EXIT_UNKNOWN


def row(found: Counsel) -> dict[str, Any]:
    """All of it as plain data."""
    advice = found.advice
    return {
        "goal": found.goal,
        "kind": found.kind,
        "causes": [problem.to_dict() for problem in found.causes],
        **ways(advice),
        "known": found.known,
        "unfit": [_payload(candidate) for candidate in found.left_out],
    }


def ways(advice: Advice) -> dict[str, Any]:
    """The alternatives as plain data."""
    return {
        "now": _way(advice.now) if advice.now else None,
        "ways": [_way(way) for way in advice.ways],
        "complete": advice.is_complete,
    }


def _way(way: Way) -> dict[str, Any]:
    payloads = [_payload(candidate) for candidate in way.payloads]
    return {"payloads": payloads, "plan": list(way.steps), "cost": way.plan.cost}


def _payload(candidate: Candidate) -> dict[str, Any]:
    caveats = [problem.to_dict() for problem in candidate.caveats]
    return {
        "payload": candidate.id,
        "version": candidate.version,
        "where": candidate.where,
        "caveats": caveats,
    }


def show(found: Counsel) -> None:
    """Tell a person: what is missing, the alternatives, and what speaks against them."""
    advice = found.advice
    render.sentence(f"goal {found.goal}")
    if advice.now is not None:
        render.sentence(f"it can be had now: {_shortly(advice.now) or 'it holds'}", colour="green")
        return
    for problem in found.causes:
        render.sentence(str(problem), colour="red")
    click.echo()
    table(
        list(_rows(advice.ways)),
        ["way", "payload", "where", "plan"],
        empty=_of_no_help(found.known),
    )
    if not advice.is_complete:
        render.sentence("there may be more: not everything could be looked at")
    caveats = dict.fromkeys(c for way in advice.ways for c in way.payloads if c.caveats)
    for mark, candidates in (("but ", tuple(caveats)), ("left out: ", found.left_out)):
        for candidate in candidates:
            for problem in candidate.caveats:
                render.sentence(f"{candidate.name}: {problem}", colour="yellow", mark=mark)


def in_a_sentence(advice: Advice) -> str:
    """The best alternative for a person who asked for more than this goal."""
    if advice.now is not None:
        return f"it can be had now: {_shortly(advice.now) or 'it holds'}"
    if not advice.ways:
        return "no payload that is known of would help" if advice.is_complete else ""
    best = advice.ways[0]
    names = " and ".join(f"{c.name} ({c.where})" for c in best.payloads)
    more = len(advice.ways) - 1
    others = f", or {more} other way{'s' if more > 1 else ''}" if more else ""
    return f"{names} would do: {_shortly(best) or 'it then holds'}{others}"


def _of_no_help(known: int) -> str:
    match known:
        case 0:
            return "no payload is known of; with --wheelhouse, others are looked through"
        case 1:
            return "the one payload that is known of would not help"
    return f"none of the {known} payloads that are known of would help"


def _rows(ways: Iterable[Way]) -> Iterator[dict[str, Any]]:
    """A row a payload; the plan stands with the first of each way."""
    for number, way in enumerate(ways, 1):
        for index, candidate in enumerate(way.payloads):
            yield {
                "way": str(number) if index == 0 else "and",
                "payload": candidate.name,
                "where": candidate.where,
                "plan": _shortly(way) or "it then holds" if index == 0 else " ",
            }


def _shortly(way: Way) -> str:
    return ", then ".join(step.split(" ")[0] for step in way.steps)
