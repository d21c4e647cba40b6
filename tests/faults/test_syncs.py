"""The documentation lists each place in the source that syncs."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/reliability/syncs.md"
PORTIONS = ("host", "planning", "transport", "wheelhouse", "plugins/sdk")
_ROW = re.compile(r"^\| `([^`]+\.py)` `(\w+)` \|", re.MULTILINE)
_SYNC = re.compile(
    r"os\.(fsync|fdatasync|sync)$|_libc\.syncfs$|disk\.sync(_file_system)?$|^_?sync(_folder)?$"
)


def places() -> Iterator[tuple[str, str]]:
    """File and function of each call; of SQLite, the name that its settings have."""
    for portion in PORTIONS:
        for path in sorted((ROOT / portion / "nondum").rglob("*.py")):
            if "template" in path.parts:
                continue
            tree = ast.parse(path.read_text(encoding="utf-8"))
            name = path.relative_to(ROOT).as_posix()
            yield from ((name, place) for place in _places(tree))


def _places(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            calls = (one for one in ast.walk(node) if isinstance(one, ast.Call))
            if any(_SYNC.search(ast.unparse(call.func)) for call in calls):
                yield node.name
        elif isinstance(node, ast.Assign) and "PRAGMA synchronous" in ast.unparse(node.value):
            yield ast.unparse(node.targets[0])


def test_each_place_that_syncs_is_listed_with_its_promise() -> None:
    listed = _ROW.findall(PAGE.read_text(encoding="utf-8"))
    assert len(listed) == len(set(listed))
    assert set(listed) == set(places())
