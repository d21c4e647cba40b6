"""One tree of errors: what nondum lets out derives from NondumError, and the tree is as drawn."""

from __future__ import annotations

import ast
import builtins
import re
from functools import cache
from pathlib import Path

import pytest

from nondum.sdk import errors

ROOT = Path(__file__).parent.parent
FOLDERS = (
    "host/nondum",
    "planning/nondum",
    "plugins/host-zenoh/nondum_host_zenoh",
    "plugins/sdk/nondum",
    "transport/nondum",
    "wheelhouse/nondum",
)
SIGNALS = {
    "Departed": "transport/nondum/transport/peers",
    "FormulaWrong": "plugins/sdk/nondum/sdk",
    "Malformed": "wheelhouse/nondum/wheelhouse/trust",
    "Mismatch": "plugins/sdk/nondum/sdk",
    "Misplaced": "planning/nondum/planning",
    "OutOfPlace": "transport/nondum/transport/peers",
    "PatternInvalid": "planning/nondum/planning",
    "TooManyProblems": "planning/nondum/planning",
    "TooMuchWork": "planning/nondum/planning",
    "TurnedAway": "transport/nondum/transport/peers",
    "WrongKind": "wheelhouse/nondum/wheelhouse/trust",
}
"""Exceptions by which one package talks to itself, and that package; those of a single module
begin with an underscore."""
DRAWN = re.compile(r"^    ((?:│   |    )*)[├└]── (\w+)", re.MULTILINE)


@cache
def sources() -> dict[str, ast.Module]:
    paths = (path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))
    return {
        path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in paths
        if "template" not in path.parts
    }


@cache
def classes() -> tuple[tuple[str, str, tuple[str, ...]], ...]:
    """File, name and bases of every class."""
    return tuple(
        (path, node.name, tuple(ast.unparse(base) for base in node.bases))
        for path, tree in sources().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    )


@cache
def exceptions() -> dict[str, tuple[str, str]]:
    """Name → file and base of every exception class."""
    found: dict[str, tuple[str, str]] = {}
    while True:
        more = {
            name: (path, base)
            for path, name, bases in classes()
            for base in bases
            if name not in found and (base in found or is_builtin(base))
        }
        if not more:
            return found
        found |= more


def is_builtin(name: str) -> bool:
    kind = getattr(builtins, name, None)
    return isinstance(kind, type) and issubclass(kind, BaseException)


def drawn() -> dict[str, str]:
    """Name → parent, as the tree in `errors.py` has them."""
    parents, above = {}, ["NondumError"]
    for match in DRAWN.finditer(errors.__doc__ or ""):
        depth = len(match[1]) // 4
        above = [*above[: depth + 1], match[2]]
        parents[match[2]] = above[depth]
    return parents


def test_the_tree_is_as_drawn() -> None:
    in_tree = {"NondumError"}
    found = exceptions()
    while more := {n for n, (_, base) in found.items() if base in in_tree} - in_tree:
        in_tree |= more
    assert drawn() == {name: found[name][1] for name in in_tree - {"NondumError"}}


def test_every_other_exception_is_a_signal() -> None:
    others = exceptions().keys() - drawn().keys() - {"NondumError"}
    assert {name for name in others if not name.startswith("_")} == SIGNALS.keys(), (
        "derive it from a class of nondum.sdk.errors, or keep it within its package"
    )


@pytest.mark.parametrize("signal", SIGNALS)
def test_signals_stay_within_their_package(signal: str) -> None:
    for path, tree in sources().items():
        names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        assert signal not in names or path.startswith(f"{SIGNALS[signal]}/"), path


def test_no_module_raises_a_bare_exception() -> None:
    for path, tree in sources().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
                assert ast.unparse(node.exc.func) not in ("Exception", "BaseException"), path
