"""Tests that failed in a run and passed alone: named on a page until their cause is removed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs/reliability/unstable.md"
MOST = 3
"""More than these in one run fail it."""
UNKNOWN = "not known yet"

HEAD = """\
# Tests that failed once without a reason that is known

`./run tests` runs a test that failed again, alone, once. If it passes then, the run may pass, and
the test is written down here with the evidence that was kept. An entry is closed by a cause that
was found and removed, never by a wider margin: *cause* then says what it was and the commit that
removed it.

| test | date | commit | cause |
|---|---|---|---|
"""

_ROW = re.compile(r"^\| `(?P<test>.+?)` \| (?P<date>\S+) \| (?P<commit>\S+) \| (?P<cause>.*) \|$")


@dataclass(frozen=True, slots=True)
class Entry:
    """One time that it happened."""

    test: str
    date: str
    commit: str
    cause: str = UNKNOWN


def read(text: str) -> tuple[Entry, ...]:
    """The entries of a page."""
    found = (_ROW.match(line) for line in text.splitlines())
    return tuple(Entry(**match.groupdict()) for match in found if match)


def written(entries: Sequence[Entry]) -> str:
    """A page of entries."""
    rows = [f"| `{e.test}` | {e.date} | {e.commit} | {e.cause} |\n" for e in entries]
    return HEAD + "".join(rows)


def add(page: Path, entries: Sequence[Entry]) -> None:
    """Write entries down below those that the page has."""
    before = read(page.read_text(encoding="utf-8")) if page.exists() else ()
    new = [entry for entry in entries if entry not in before]
    page.write_text(written([*before, *new]), encoding="utf-8")
