"""The list of steps and their guards, as the documentation has it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from tests.mutation.steps import Step

PAGE = Path(__file__).parents[2] / "docs/reliability/verification.md"
HEAD = """\
# Steps of verification, and the tests that guard them

Written by `python -m tests.mutation`, which removes one step after the other from a copy of the
source and runs the tests nearest to it: each must make one fail. With each stands the first test
that misses it. (`--only wheel.py` tries a part, `--all` what is here already, too.)

A step is what leads to a refusal of something that was plugged in, or that a worker, a program of
this machine, or another host, has sent: a condition, of `a or b` each, and each bound of two; a
condition that must hold, or what follows refuses; a kind of error that is answered with a refusal;
the loop or call by which flaws that were found are told; a row of a table of refused system calls,
or of namespaces. In the modules by which a process is confined, more is a step: each call made for
what it does, and each check that it was done; each flag of a mount, right of Landlock and resource
limit; each loop. What limits of this machine do (a full disk) is no step. Tests of properties
(Hypothesis) count only if they fail with each of three seeds. Modules that refuse something and
stand aside are in `tests/mutation/guards.py`, with the reason; a test sees that no module is in
neither list. A step that another one makes up for has no test, and the reason stands in its place.
"""
MISSING = "**no test misses it**"
_SPARED = "no test: "
_TOOK = re.compile(r"All of them took .*$", re.MULTILINE)
_SECTION = re.compile(r"^## `(.+)`$", re.MULTILINE)
_ROW = re.compile(r"^\| `` (.+) `` \| (.+) \|$", re.MULTILINE)


class Key(NamedTuple):
    """A step, whatever line it moves to; the same condition again has the next number."""

    module: str
    condition: str
    number: int


def keyed(steps: Sequence[Step]) -> dict[Key, Step]:
    """Steps by what they are called on the page."""
    found: dict[Key, Step] = {}
    for step in steps:
        number = 1
        while (key := Key(step.module, step.condition, number)) in found:
            number += 1
        found[key] = step
    return found


def spared(why: str) -> str:
    """What stands in the place of a guard, where none is needed."""
    return f"{_SPARED}{why}"


def read(text: str) -> dict[Key, str]:
    """Key → guard."""
    guards: dict[Key, str] = {}
    _, *parts = _SECTION.split(text)
    for module, rows in zip(parts[::2], parts[1::2], strict=True):
        for condition, guard in _ROW.findall(rows):
            number = 1
            while (key := Key(module, condition.replace("\\|", "|"), number)) in guards:
                number += 1
            guards[key] = guard.strip("`")
    return guards


def took(text: str) -> str:
    """What a page says of the last run that tried every step."""
    found = _TOOK.search(text)
    return found[0] if found else ""


def written(guards: Mapping[Key, str], took: str = "") -> str:
    """The page; `took` is a sentence about the last run that tried every step."""
    modules = len({key.module for key in guards})
    lines = [HEAD, f"Here are {len(guards)} steps in {modules} modules. {took}".strip() + "\n"]
    for module in dict.fromkeys(key.module for key in guards):
        lines += [f"## `{module}`\n", "| refused when | guarded by |", "|---|---|"]
        for key, guard in guards.items():
            if key.module == module:
                condition = key.condition.replace("|", "\\|")
                told = guard if guard == MISSING or guard.startswith(_SPARED) else f"`{guard}`"
                lines.append(f"| `` {condition} `` | {told} |")
        lines.append("")
    return "\n".join(lines)
