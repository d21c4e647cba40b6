"""The layout of the repository: packages, imports between them, and the shared namespace."""

from __future__ import annotations

import ast
import re
from graphlib import CycleError
from pathlib import Path

import pytest
from tests.kit.packages import PORTIONS, imported_names, imports, layers, modules

ROOT = Path(__file__).parent.parent
MAY_IMPORT = {
    "nondum.sdk": set(),
    "nondum.planning": {"nondum.sdk"},
    "nondum.transport": {"nondum.sdk"},
    "nondum.wheelhouse": {"nondum.sdk"},
    "nondum.host": {"nondum.sdk", "nondum.planning", "nondum.transport", "nondum.wheelhouse"},
    "nondum.cli": {
        *("nondum.sdk", "nondum.planning", "nondum.transport", "nondum.wheelhouse"),
        "nondum.host",
    },
}
IMPURE = {"asyncio", "logging", "os", "random", "socket", "sqlite3", "subprocess", "time"}


def imported_test_modules(text: str) -> set[str]:
    """Names of modules and their members, where a part of the name is that of a test module."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {f"{node.module or ''}.{alias.name}" for alias in node.names}
    return {name for name in names if any(x.startswith("test_") for x in name.split("."))}


@pytest.mark.parametrize("portion", PORTIONS)
def test_imports_point_inwards(portion: str) -> None:
    allowed = MAY_IMPORT[portion] | {portion}
    for path in modules(portion):
        for name in imported_names(path):
            if name.startswith("nondum."):
                assert ".".join(name.split(".")[:2]) in allowed, f"{path} imports {name}"


@pytest.mark.parametrize("portion", PORTIONS)
def test_no_packages_import_each_other(portion: str) -> None:
    """Neither two of them nor more in a circle (`CycleError`)."""
    assert layers(imports(portion))


@pytest.mark.parametrize(
    ("graph", "expected"),
    [
        ({"a": {"b"}, "b": set()}, [["b"], ["a"]]),
        ({"a": {"b", "c"}, "b": {"c"}, "c": set()}, [["c"], ["b"], ["a"]]),
    ],
)
def test_layers_are_told_innermost_first(
    graph: dict[str, set[str]], expected: list[list[str]]
) -> None:
    assert layers(graph) == expected


def test_circle_of_packages_is_found() -> None:
    with pytest.raises(CycleError):
        layers({"a": {"b"}, "b": {"c"}, "c": {"a"}})


def test_planning_has_no_clock_and_no_io() -> None:
    for path in modules("nondum.planning"):
        impure = {name.split(".")[0] for name in imported_names(path)} & IMPURE
        assert not impure, f"{path} imports {impure}"


def test_one_place_starts_behaviours() -> None:
    """What a leaf did not start, nothing halts when the leaf is stopped."""
    calls = re.compile(r"runner\.start\(")
    paths = [*modules("nondum.planning"), *modules("nondum.host")]
    found = [path.name for path in paths if calls.search(path.read_text(encoding="utf-8"))]
    assert found == ["running.py"]


def test_no_portion_claims_the_namespace() -> None:
    claims = [p for p in ROOT.glob("**/nondum/__init__.py") if ".venv" not in p.parts]
    assert not claims, "nondum is a PEP 420 namespace: no nondum/__init__.py anywhere"


@pytest.mark.parametrize("portion", PORTIONS)
def test_each_portion_is_typed(portion: str) -> None:
    assert (PORTIONS[portion] / "py.typed").is_file()


def test_host_names_no_plugin() -> None:
    """Nothing in what hosts run may know a payload; pyperplan's planner is found by its group."""
    plugins = [p.name for p in (ROOT / "plugins").iterdir() if (p / "pyproject.toml").is_file()]
    plain = {"gps", "lab", "speaker"}  # also words of the design: a type of messages, of units …
    names = {n for n in plugins if n not in {"sdk", *plain}}
    modules_of = {f"nondum_{n.replace('-', '_')}" for n in {*names, *plain}}
    for portion in PORTIONS:
        for path in modules(portion):
            text = path.read_text(encoding="utf-8")
            found = [n for n in (*names, *modules_of) if n in text]
            assert not found, f"{portion}: {path} names {found}"


def test_helpers_do_not_live_in_test_modules() -> None:
    found = {
        path.relative_to(ROOT).as_posix()
        for folder in (ROOT / "tests", *ROOT.glob("plugins/*/tests"))
        for path in folder.rglob("*.py")
        if "data" not in path.parts and imported_test_modules(path.read_text(encoding="utf-8"))
    }
    assert not found


@pytest.mark.parametrize(
    "text",
    [
        "from tests.host.test_it import helper",
        "from tests.host import test_it",
        "from .test_it import helper",
        "import tests.host.test_it",
        "def late():\n    from test_it import helper",
    ],
)
def test_helper_from_a_test_module_is_found(text: str) -> None:
    assert imported_test_modules(text)


def test_helper_from_a_helper_module_is_fine() -> None:
    assert not imported_test_modules("from tests.kit.until import until\nimport latest_news")
