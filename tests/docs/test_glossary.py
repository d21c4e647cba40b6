"""What people are told uses the glossary's words."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCES = sorted([*ROOT.glob("host/nondum/**/*.py"), *ROOT.glob("plugins/sdk/nondum/**/*.py")])
OTHER_WORDS = re.compile(r"payloads?\b.*\b(taken|brought|taking|bringing) in\b")
"""Of a payload that is being installed."""


def told(source: Path) -> Iterator[str]:
    """The texts in a module but for its documentation."""
    tree = ast.parse(source.read_text(encoding="utf-8"))
    documentation = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield "".join(str(part.value) for part in node.values if isinstance(part, ast.Constant))
        elif isinstance(node, ast.Constant) and id(node) not in documentation:
            yield str(node.value)


def test_payloads_on_their_way_in_are_being_installed() -> None:
    found = [(source, text) for source in SOURCES for text in told(source)]
    assert not [one for one in found if OTHER_WORDS.search(one[1])]
