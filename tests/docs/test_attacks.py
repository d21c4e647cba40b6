"""Each attack of docs/reliability/attacks.md names tests that there are."""

from __future__ import annotations

import re

import pytest
from tests.runner.stages import ROOT

PAGE = ROOT / "docs/reliability/attacks.md"
ROWS = [
    line for line in PAGE.read_text(encoding="utf-8").splitlines() if re.match(r"\| [a-z]", line)
][1:]


@pytest.mark.parametrize("row", ROWS, ids=range(len(ROWS)))
def test_attack_has_a_test(row: str) -> None:
    tests = re.findall(r"`(tests/[^`]+)::(\w+)`", row)
    assert tests
    for file, name in tests:
        assert f"def {name}(" in (ROOT / file).read_text(encoding="utf-8"), name
