"""The map shows what is there: every file, folder and class that it names."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.docs import packages

ROOT = Path(__file__).parents[2]
FOLDERS = ("host", "planning", "transport", "wheelhouse", "plugins", "tests", "docs", "demo")
TEXT = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
QUOTED = sorted(set(re.findall(r"`([^`\s]+)`", TEXT)))
PATHS = [name for name in QUOTED if re.fullmatch(r"[\w/.-]+(\.py|\.md|/)", name)]
CLASSES = sorted(set(re.findall(r"\b[A-Z][a-z]+[A-Z][A-Za-z]+\b", TEXT)))


@pytest.mark.parametrize("name", PATHS)
def test_named_path_is_there(name: str) -> None:
    found = (p for folder in FOLDERS for p in (ROOT / folder).rglob(Path(name).name))
    wanted = name.rstrip("/")
    assert any(f"/{p.as_posix()}".endswith(f"/{wanted}") for p in found)


@pytest.fixture(scope="module")
def sources() -> str:
    folders = ("host", "planning", "transport", "wheelhouse", "plugins/sdk")
    modules = (path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    return "\n".join(path.read_text(encoding="utf-8") for path in modules)


@pytest.mark.parametrize("name", CLASSES)
def test_named_class_is_there(name: str, sources: str) -> None:
    assert re.search(rf"\bclass {name}\b", sources)


def test_picture_shows_the_packages_as_they_are() -> None:
    assert packages.drawn() == packages.picture(), "run: python -m tests.docs.reference"
