"""The page that others copy from says what the code says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1]
PAGE = (FOLDER / "README.md").read_text(encoding="utf-8")
QUOTED = re.findall(r"^```(?:python|toml)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("block", QUOTED, ids=lambda block: block.splitlines()[0])
def test_every_line_that_is_quoted_is_in_one_file(block: str) -> None:
    files = [FOLDER / "pyproject.toml", *FOLDER.glob("nondum_host_lamps/*.py")]
    lines = set(filter(None, block.splitlines()))
    assert any(lines <= set(f.read_text(encoding="utf-8").splitlines()) for f in files)
