"""What is written as TOML is read back as the same table."""

from __future__ import annotations

import doctest
import tomllib
from pathlib import Path
from typing import Any

import pytest
from demo.shuffle import package, toml
from hypothesis import given
from hypothesis import strategies as st

PLUGINS = Path(__file__).parents[3] / "plugins"

KEYS = st.text(st.characters(codec="utf-8", exclude_characters="\x7f"), max_size=6)
SINGLE = st.one_of(st.booleans(), st.integers(-(2**63), 2**63 - 1), KEYS)
VALUES = st.one_of(SINGLE, st.lists(SINGLE, max_size=3))
TABLES = st.recursive(
    st.dictionaries(KEYS, VALUES, max_size=3),
    lambda inner: st.dictionaries(
        KEYS, st.one_of(VALUES, inner, st.lists(inner, min_size=1, max_size=2)), max_size=3
    ),
    max_leaves=12,
)


@given(TABLES)
def test_any_table_comes_back(table: dict[str, Any]) -> None:
    assert tomllib.loads(toml.text(table)) == table


@pytest.mark.parametrize(
    "path", sorted(PLUGINS.glob("*/p*.toml")), ids=lambda p: "/".join(p.parts[-2:])
)
def test_every_manifest_comes_back(path: Path) -> None:
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    assert tomllib.loads(toml.text(table)) == table


def test_examples_in_the_docstrings_hold() -> None:
    assert doctest.testmod(toml).failed == 0
    assert doctest.testmod(package).failed == 0
