"""The house keeps its shape: rooms, arrows between them, and the shared namespace."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PORTIONS = {
    "nondum.sdk": ROOT / "plugins/sdk/nondum/sdk",
    "nondum.planning": ROOT / "planning/nondum/planning",
    "nondum.transport": ROOT / "transport/nondum/transport",
    "nondum.wheelhouse": ROOT / "wheelhouse/nondum/wheelhouse",
    "nondum.host": ROOT / "host/nondum/host",
}
MAY_IMPORT = {
    "nondum.sdk": set(),
    "nondum.planning": {"nondum.sdk"},
    "nondum.transport": {"nondum.sdk"},
    "nondum.wheelhouse": {"nondum.sdk"},
    "nondum.host": {"nondum.sdk", "nondum.planning", "nondum.transport", "nondum.wheelhouse"},
}
IMPURE = {"asyncio", "logging", "os", "random", "socket", "sqlite3", "subprocess", "time"}


def modules(portion: str) -> Iterator[Path]:
    """A portion's modules; the text that new plugins are made from is none."""
    return (p for p in PORTIONS[portion].rglob("*.py") if "template" not in p.parts)


def imported_names(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


@pytest.mark.parametrize("portion", PORTIONS)
def test_imports_point_inwards(portion: str) -> None:
    allowed = MAY_IMPORT[portion] | {portion}
    for path in modules(portion):
        for name in imported_names(path):
            if name.startswith("nondum."):
                assert ".".join(name.split(".")[:2]) in allowed, f"{path} imports {name}"


def test_planning_has_no_clock_and_no_io() -> None:
    for path in modules("nondum.planning"):
        impure = {name.split(".")[0] for name in imported_names(path)} & IMPURE
        assert not impure, f"{path} imports {impure}"


def test_no_portion_claims_the_namespace() -> None:
    claims = [p for p in ROOT.glob("**/nondum/__init__.py") if ".venv" not in p.parts]
    assert not claims, "nondum is a PEP 420 namespace: no nondum/__init__.py anywhere"


@pytest.mark.parametrize("portion", PORTIONS)
def test_each_portion_is_typed(portion: str) -> None:
    assert (PORTIONS[portion] / "py.typed").is_file()


def test_host_names_no_plugin() -> None:
    """Nothing in what hosts run may know a payload; pyperplan's planner is found by its group."""
    plugins = [p.name for p in (ROOT / "plugins").iterdir() if (p / "pyproject.toml").is_file()]
    names = {n for n in plugins if n not in {"sdk", "speaker"}}  # also plain words of the design
    for portion in PORTIONS:
        for path in modules(portion):
            text = path.read_text(encoding="utf-8")
            found = [n for n in names if n in text or f"nondum_{n.replace('-', '_')}" in text]
            assert not found, f"{portion}: {path} names {found}"
