"""Every code that planning gives is documented, and nothing else is."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
CODE = re.compile(r"\b(?:PDDL|PHRASE|PLAN|WHY)_[A-Z_]+\b")


def test_documented_codes_are_those_that_are_given() -> None:
    sources = (ROOT / "planning/nondum/planning").rglob("*.py")
    quoted = re.compile(rf'"({CODE.pattern})"')
    given = {code for path in sources for code in quoted.findall(path.read_text("utf-8"))}
    documented = set(CODE.findall((ROOT / "docs/fragments.md").read_text("utf-8")))
    assert documented == given
