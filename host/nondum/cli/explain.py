"""`nondum explain`: what a code means and what to do, from the one table that all tell from."""

from __future__ import annotations

import difflib
import json
from collections.abc import Sequence
from importlib import resources
from typing import Any

import click
from click.shell_completion import CompletionItem

from nondum.cli import render
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.sdk import codes
from nondum.sdk.codes import Code
from nondum.sdk.errors import ConfigRefused, Problem

TOLD = "told.json"
"""The sentences of each code, as the sources have them, with `…` for what differs from case to
case; written by `python -m tests.docs.reference`."""


def _completions(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    wanted = incomplete.upper()
    return [
        CompletionItem(code.name, help=code.meaning)
        for code in codes.every().values()
        if code.name.startswith(wanted)
    ]


@click.command()
@click.argument("code", required=False, shell_complete=_completions)
@json_option
@click.pass_obj
def explain(session: Session, code: str | None) -> None:
    """Say what a code means, where it comes from, and what to do.

    Every refusal begins with its code. Without CODE, all are listed, area by area.

    \b
    Examples: nondum explain WHEEL_RECORD
              nondum explain --json
    """
    if code is None:
        _list(session)
        return
    found = codes.find(code.upper())
    if found is None:
        raise ConfigRefused(_unknown(code))
    view = _view(found)
    if session.as_json:
        render.as_json(view)
        return
    click.echo(f"{found.name}  ({view['area']})")
    render.sentence(found.meaning)
    for name, said in (("told as", view["told"]), ("usual causes", [found.causes])):
        for line in filter(None, said):
            render.sentence(f"  {name}: {line}")
    render.sentence(f"→ {found.remedy}")


def _list(session: Session) -> None:
    if session.as_json:
        render.as_json({"codes": [_view(code) for code in codes.every().values()]})
        return
    for area, declared in codes.areas().items():
        click.secho(area, bold=True)
        for code in sorted(declared, key=lambda code: code.name):
            render.sentence(f"  {code.name:<26} {code.meaning}")


def _view(code: Code) -> dict[str, Any]:
    area = next(area for area, declared in codes.areas().items() if code in declared)
    return {
        "code": code.name,
        "area": area,
        "meaning": code.meaning,
        "told": _told().get(code.name, []),
        "causes": code.causes,
        "fix": code.remedy,
    }


def _told() -> dict[str, Sequence[str]]:
    text = resources.files(__package__).joinpath(TOLD).read_text(encoding="utf-8")
    said: dict[str, Sequence[str]] = json.loads(text)
    return said


def _unknown(name: str) -> Problem:
    near = difflib.get_close_matches(name.upper(), codes.every(), n=3, cutoff=0.5)
    near += [code for code in codes.every() if name.upper() in code and code not in near][:5]
    fix = f"did you mean {' or '.join(near)}?" if near else ""
    return Problem("CODE_UNKNOWN", f"no refusal has the code {name[:60]!r}", fix=fix)
