"""What the robot believes, wants and does, and why."""

from __future__ import annotations

import contextlib
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.cli import complete, live, render
from nondum.cli.advise import (
    in_a_sentence,
    row,
    show,
    surroundings,
    ways,
    wheelhouse_option,
    without_number,
)
from nondum.cli.connection import json_option
from nondum.cli.failure import tell_problem
from nondum.cli.session import Session
from nondum.cli.status import show_told
from nondum.cli.table import cell, table
from nondum.planning.words.pattern import with_blanks
from nondum.sdk.errors import GoalRefused

if TYPE_CHECKING:
    from nondum.planning.explain.advise import Advice

GLANCES = 3
"""The number of suspended goals for which `nondum why` looks for what would help: it takes time."""


@click.command()
@click.option(
    "--why", metavar="FACT", help="Only this fact, true or not, and all that bears on it."
)
@click.option("--parked", is_flag=True, help="What waits for objects that are not there now.")
@live.follow_option(live.REDRAWN)
@json_option
@click.pass_obj
def facts(session: Session, why: str | None, parked: bool, follow: bool) -> None:
    """What the robot believes, and why.

    A fact's age is the time since somebody first said so. With --why: who speaks for it and against
    it, whose word counts, and which behaviours would change it.

    \b
    Examples: nondum facts
              nondum facts --follow
              nondum facts --parked
              nondum facts --why "(ready panther__eye__camera)"
    """
    if why is not None and parked:
        raise click.UsageError("--why is of one fact, --parked of those that wait: choose one")
    if why is not None and follow:
        raise click.UsageError("--follow is of all facts, --why of one: choose one")
    if why is not None:
        _explain(session, session.ask("fact", fact=why))
        return
    if follow:
        for rows in session.follow("follow_facts", parked=parked):
            if session.as_json:
                render.as_json_line(rows)
            else:
                live.redraw(partial(_show_facts, session.short(rows, refresh=True), parked))
        return
    rows = session.ask("facts", parked=parked)
    render.as_json(rows) if session.as_json else _show_facts(session.short(rows), parked)


def _show_facts(rows: list[dict[str, Any]], parked: bool) -> None:
    shown = [{**row, "since": render.age(row["age_s"])} for row in rows]
    last = "absent" if parked else "value"
    table(shown, ["fact", "since", "source", last], empty=_NOTHING[parked])


_NOTHING = {False: "nothing is believed", True: "nothing waits for an object"}


def _explain(session: Session, found: dict[str, Any]) -> None:
    if session.as_json:
        render.as_json(found)
        return
    found = session.short(found)
    render.sentence(f"({found['fact']}) {'holds' if found['holds'] else 'does not hold'}")
    for side in ("for", "against"):
        for word in found[side]:
            behaviour = f" by its behaviour {word['behaviour']}" if word["behaviour"] else ""
            said = ", ".join(filter(None, (f"{word['said']}{behaviour}", _ago(word))))
            render.sentence(said, mark=f"{side} it: ")
    told = [
        ("its value", found["value"] and cell(found["value"])),
        ("instead", found["instead"] and f"({found['instead']}) is believed"),
        ("parked", found["absent"] and f"there is no object {', '.join(found['absent'])} now"),
        ("observed by", ", ".join(found["observed_by"])),
        ("would be made true by", ", ".join(found["assumed_by"])),
        ("would be made false by", ", ".join(found["denied_by"])),
        ("note", found["hint"]),
    ]
    if not (found["for"] or found["against"]):
        render.sentence("no source has said so")
    for name, text in told:
        if text:
            render.sentence(str(text), mark=f"{name}: ")


def _ago(word: dict[str, Any]) -> str:
    age = render.age(word["age_s"])
    return age and f"{age} ago"


@click.command()
@live.follow_option(live.REDRAWN)
@json_option
@click.pass_obj
def goals(session: Session, follow: bool) -> None:
    """What can be asked for now, and what was.

    NOW says whether it holds, can be had as far as anyone can see, or cannot, and then what is
    missing; FROM names the components that brought the words. Of goals that were given to peers,
    HOST says whose they are.

    \b
    Examples: nondum goals
              nondum goals --follow
    """
    if follow:
        for view in session.follow("follow_goals"):
            if session.as_json:
                render.as_json_line(view)
            else:
                live.redraw(partial(_show_goals, session.short(view, refresh=True)))
        return
    view = session.ask("goals")
    render.as_json(view) if session.as_json else _show_goals(session.short(view))


_NO_WORDS = "nothing can be asked for yet: nothing is plugged in that knows words"


def _show_goals(view: dict[str, Any]) -> None:
    can = [{**row, "words": _words(row["words"])} for row in view["can"]]
    shown = [{**row, "now": _outlook(row)} for row in can]
    table(shown, ["words", "goal", "kind", "now", "from"], empty=_NO_WORDS)
    for problem in view["problems"]:
        render.sentence(problem, colour="red")
    click.echo()
    columns = ["id", "text", "goal", "kind", "state", "reason"]
    if view["elsewhere"]:
        columns.insert(1, "host")
    rows = map(render.goal, (*view["given"], *view["elsewhere"]))
    given = [{**row, "reason": _reason(row)} for row in rows]
    table(given, columns, empty="no goal was given")


def _reason(row: dict[str, Any]) -> str:
    how = f"to go on: nondum goal --resume {row['id']}" if row["resumable"] else ""
    return "; ".join(filter(None, (row["reason"], how)))


def _words(said: str) -> str:
    """A sentence; of a phrase that cannot be said, for nothing can be named in it, the pattern."""
    return with_blanks(said) if "{" in said else said


def _outlook(row: dict[str, Any]) -> str:
    """The first of what is missing: `nondum why` tells all of it."""
    first, more = "".join(row["lacks"][:1]), len(row["lacks"]) - 1
    told = f"{first}; {more} more, see `nondum why {row['words']}`" if more > 0 else first
    return ": ".join(filter(None, (row["now"], told)))


@click.command()
@json_option
@click.pass_obj
def plan(session: Session) -> None:
    """The plans that are being carried out, that of the most urgent goal first.

    Example: nondum plan
    """
    view = session.ask("plan")
    if session.as_json:
        render.as_json(view)
        return
    for one in (view, *view["beside"]):
        if one["goal"]:
            click.echo(f"goal {one['id']}  {one['goal']}  {one['kind']}")
        steps = [{**row, "action": row["told"], "why": row["told_why"]} for row in one["steps"]]
        table(steps, ["step", "action", "state", "why"], empty="no plan; `nondum why` says why")


@click.command()
@click.argument("goal", nargs=-1, metavar="[GOAL|FACT]...", shell_complete=complete.goal_words)
@wheelhouse_option
@json_option
@click.pass_obj
def why(session: Session, goal: tuple[str, ...], wheelhouses: tuple[Path, ...]) -> None:
    """Why the robot does what it does, or why it cannot.

    Of goals that are suspended: what they lack, and the best that a known payload would do for it.

    With a goal (its number, words, or PDDL) or a fact: what it lacks, which step needs that, who
    used to supply it, and which known payload would help, as `nondum advise` says.

    \b
    Examples: nondum why
              nondum why 1
              nondum why "(following self person)"
    """
    if goal:
        _why_not(session, " ".join(goal), wheelhouses)
        return
    view, helps = session.ask("why"), _helps(session, wheelhouses)
    if session.as_json:
        told = [{"goal": id, **(ways(found) if found else {})} for id, found in helps.items()]
        render.as_json({**view, "advice": told})
        return
    view = session.short(view)
    for sentence in view["sentences"]:
        render.sentence(sentence)
    for problem in view["problems"]:
        render.sentence(problem, colour="red")
    for id, found in helps.items():
        parts = (in_a_sentence(found) if found else "", f"see `nondum advise {id}`")
        render.sentence("; ".join(filter(None, parts)), mark=f"goal {id}: ")
    if view["told"]:
        click.echo()
    show_told(view["told"])


def _helps(session: Session, wheelhouses: tuple[Path, ...]) -> dict[str, Advice | None]:
    """Suspended goals, by number, and what would help; None where that was not looked at."""
    suspended = [goal for goal in session.ask("status")["goals"] if goal["state"] == "suspended"]
    if not suspended:
        return {}
    around, _ = surroundings(session, wheelhouses)
    helps: dict[str, Advice | None] = {goal["id"]: None for goal in suspended}
    for goal in suspended[:GLANCES]:
        with contextlib.suppress(GoalRefused):  # its words may mean nothing any more
            helps[goal["id"]] = around.glance(goal["goal"])
    return helps


def _why_not(session: Session, asked: str, wheelhouses: tuple[Path, ...]) -> None:
    """A goal's number stands for the goal; a fact that holds is explained as such."""
    if asked.isdecimal():
        asked = without_number(session, asked)
    elif asked.startswith("(") and asked.count("(") == 1:
        fact = session.ask("fact", fact=asked)
        if fact["holds"]:
            _explain(session, fact)
            return
    around, problems = surroundings(session, wheelhouses)
    found = around.counsel(asked)
    if session.as_json:
        render.as_json(row(found))
        return
    for problem in problems:
        tell_problem(problem, as_warning=True)
    show(found)
