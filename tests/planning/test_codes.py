"""Every code that planning and its workbench give is documented, and nothing else is."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCES = ("planning/nondum/planning", "plugins/pddl-workbench/nondum_pddl_workbench")
CODE = re.compile(r"\b(?:PDDL|PHRASE|PLAN|WHY)_[A-Z_]+\b")


def test_documented_codes_are_those_that_are_given() -> None:
    sources = (path for folder in SOURCES for path in (ROOT / folder).rglob("*.py"))
    quoted = re.compile(rf'"({CODE.pattern})"')
    given = {code for path in sources for code in quoted.findall(path.read_text("utf-8"))}
    documented = set(CODE.findall((ROOT / "docs/fragments.md").read_text("utf-8")))
    assert documented == given
