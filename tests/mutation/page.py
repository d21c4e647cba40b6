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
source and runs the tests: each must make one fail. A step is a condition under which something that
was plugged in, or a frame that a worker sent, is refused; with each stands the first test that
misses it.
"""
MISSING = "**no test misses it**"
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


def written(guards: Mapping[Key, str]) -> str:
    """The page."""
    lines = [HEAD]
    for module in dict.fromkeys(key.module for key in guards):
        lines += [f"## `{module}`\n", "| refused when | guarded by |", "|---|---|"]
        for key, guard in guards.items():
            if key.module == module:
                condition = key.condition.replace("|", "\\|")
                told = guard if guard == MISSING else f"`{guard}`"
                lines.append(f"| `` {condition} `` | {told} |")
        lines.append("")
    return "\n".join(lines)
