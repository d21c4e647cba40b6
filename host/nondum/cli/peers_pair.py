"""The command that pairs this host with another, by a code that two people compare."""

from __future__ import annotations

import queue
import select
import sys
import termios
import threading
from contextlib import closing
from typing import Any

import click

from nondum.cli import failure, render
from nondum.cli.connection import json_option
from nondum.cli.failure import EXIT_REFUSED
from nondum.cli.session import Session
from nondum.cli.table import table
from nondum.sdk.errors import NondumError, Problem

LOOK_S = 0.2
"""How often is looked, while a question stands, whether it still does."""

Row = dict[str, Any]


@click.command()
@click.argument("host", required=False)
@click.option("--yes-code", metavar="CODE", help="Say yes, if that is the code of an open window.")
@json_option
@click.pass_obj
def pair(session: Session, host: str | None, yes_code: str | None) -> int:
    """Introduce this host and another to each other.

    Run it on both hosts within two minutes. Both show a code: say yes if it is the same one. HOST
    is the other's name or fingerprint, and needed only where more than two hosts are being paired.
    Without a terminal, and with --json, no question is asked: say yes with --yes-code from another
    command, once a person has seen the code on the other host.

    \b
    Examples: nondum peers pair
              nondum peers pair rover-2
              nondum peers pair --yes-code "493 112"
    """
    row: Row
    if yes_code is not None:
        if host is not None:
            raise click.UsageError("--yes-code is about the window that is open: name no host")
        row = session.ask("peers_confirm", timeout_s=None, code=yes_code, wait=True)
        if session.as_json:
            render.as_json(row)
        return _ended(session, row)
    rows, row = _Rows(session, host), {}
    while row.get("step") not in ("agreed", "failed"):
        last, row = row, rows.next()
        if session.as_json:
            render.as_json_line(row)
        else:
            _show(session, rows, row, last)
    return _ended(session, row)


class _Rows:
    """How the window stands, told while a person is being asked, too."""

    def __init__(self, session: Session, host: str | None) -> None:
        self._session, self._host = session, host
        self._told: queue.Queue[Row | NondumError] = queue.Queue()
        threading.Thread(target=self._follow, daemon=True).start()

    def next(self) -> Row:
        """Wait for the next. Raises `NondumError`."""
        told = self._told.get()
        if isinstance(told, NondumError):
            raise told
        return told

    @property
    def is_news(self) -> bool:
        """Whether there is a next one already."""
        return not self._told.empty()

    def _follow(self) -> None:
        try:
            with closing(self._session.follow("peers_pair", host=self._host)) as rows:
                for row in rows:
                    self._told.put(row)
        except NondumError as error:
            self._told.put(error)


def _show(session: Session, rows: _Rows, row: Row, last: Row) -> None:
    match row["step"]:
        case "waiting":
            _show_waiting(row, last)
        case "comparing":
            _show_code(row)
            if sys.stdin.isatty():
                _ask(session, rows, row)
            else:
                click.echo(f'to say yes: nondum peers pair --yes-code "{row["code"]}"')
        case "confirmed":
            if last.get("code") != row["code"]:  # the other host came back, and knows no yes yet
                _show_code(row)
            render.sentence(f"waiting for the person at {row['name']} to say yes")


def _show_waiting(row: Row, last: Row) -> None:
    if not last:
        left_s = row["seconds_left"]
        click.echo(f"run `nondum peers pair` on the other host, too: {left_s} s are left")
    if row["problem"] and row["problem"] != last.get("problem"):
        failure.tell_problem(Problem(**row["problem"]), as_warning=True)
    if len(row["candidates"]) > 1 and row["candidates"] != last.get("candidates"):
        click.echo("more than one host can be paired: name one of these")
        table(row["candidates"], ["name", "fingerprint"], empty="")


def _show_code(row: Row) -> None:
    render.sentence(f"{row['name']}  {row['fingerprint']}")
    click.secho(f"code  {row['code']}", bold=True)


def _ask(session: Session, rows: _Rows, row: Row) -> None:
    """Ask whether the codes are equal, as long as the question stands."""
    termios.tcflush(sys.stdin, termios.TCIFLUSH)  # an answer to an earlier question is none to this
    click.echo(f"Does {row['name']} show the same code? [y/N]: ", nl=False)
    while not rows.is_news:
        if not select.select([sys.stdin], [], [], LOOK_S)[0]:
            continue
        answer = sys.stdin.readline()
        try:
            if answer.strip().lower() in ("y", "yes"):
                session.ask("peers_confirm", code=row["code"])
            else:
                session.ask("peers_refuse")
        except NondumError as error:  # what the question was about is over: more is told soon
            for problem in error.problems:
                failure.tell_problem(problem, as_warning=True)
        return
    click.echo()


def _ended(session: Session, row: Row) -> int:
    if row["step"] == "failed":
        if session.as_json:
            return EXIT_REFUSED  # the row has told why
        raise NondumError(Problem(**row["problem"]))
    if not session.as_json:
        render.sentence(f"paired with {row['name']}  {row['fingerprint']}", colour="green")
    return 0
