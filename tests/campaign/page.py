"""The last result of each campaign, as the documentation has it: the page is what is read."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import astuple, dataclass
from pathlib import Path

from tests.campaign.registry import CAMPAIGNS

PAGE = Path("docs/reliability/campaigns.md")
"""In the checkout."""
PASSED, FAILED = "passed", "failed"
DIRTY = "+"
"""Behind a commit: the working tree had changes, so the result is of no commit."""
HEAD = """\
# Campaigns: what takes too long for `./run tests`, and when it last passed

Written by `./run campaign`. A result is old as soon as one of the paths that the campaign covers
differs from the commit at which it passed; `./run tests` tells which results are old, and runs the
short form of these campaigns. `12 of 500` says how many pieces were done, none of them wrong, when
the time was over: the next run goes on there. A commit with `+` was changed locally, so the result
counts for no commit.

| campaign | last result | commit | date | minutes | machine | command | last passed at |
|---|---|---|---|---|---|---|---|
"""
_COLUMNS = 8
_ROW = re.compile(r"^\| " + r" \| ".join([r"([^|]*)"] * _COLUMNS) + r" \|$", re.MULTILINE)
_NEVER = "never"


@dataclass(frozen=True, slots=True)
class Last:
    """The last result of one campaign."""

    result: str
    """`passed`, `failed`, or `N of M` pieces."""
    commit: str
    """Short hash, with `+` if the working tree had changes."""
    date: str
    minutes: int
    machine: str
    command: str
    passed_at: str = ""
    """The last commit at which it passed; empty: there is none."""


def read(text: str) -> dict[str, Last]:
    """What a page says, by campaign."""
    found = {}
    for name, result, commit, date, minutes, machine, command, passed_at in _ROW.findall(text):
        if name in CAMPAIGNS:
            found[name] = Last(
                *(result, commit, date, int(minutes), machine, command.strip("`")),
                passed_at="" if passed_at == _NEVER else passed_at,
            )
    return found


def written(lasts: Mapping[str, Last]) -> str:
    """The page."""
    rows = []
    for name in CAMPAIGNS:
        if name in lasts:
            *cells, command, passed_at = astuple(lasts[name])
            cells += [f"`{command}`", passed_at or _NEVER]
            rows.append(f"| {name} | {' | '.join(map(str, cells))} |")
    listed = ["", "## What each does", "", "| campaign | what it does | covers |", "|---|---|---|"]
    for one in CAMPAIGNS.values():
        covers = ", ".join(f"`{path}`" for path in one.covers)
        listed.append(f"| **{one.name}** | {one.sentence} | {covers} |")
    return HEAD + "\n".join([*rows, *listed]) + "\n"


def load(root: Path) -> dict[str, Last]:
    """What the page of a checkout says; nothing if there is none."""
    file = root / PAGE
    return read(file.read_text(encoding="utf-8")) if file.exists() else {}


def keep(root: Path, name: str, last: Last) -> None:
    """Write the result of one campaign into the page of a checkout."""
    (root / PAGE).write_text(written({**load(root), name: last}), encoding="utf-8")
