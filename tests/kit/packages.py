"""Which packages of a portion import which: the second level, read off the sources."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[2]
PORTIONS: Mapping[str, Path] = {
    "nondum.sdk": ROOT / "plugins/sdk/nondum/sdk",
    "nondum.planning": ROOT / "planning/nondum/planning",
    "nondum.transport": ROOT / "transport/nondum/transport",
    "nondum.wheelhouse": ROOT / "wheelhouse/nondum/wheelhouse",
    "nondum.host": ROOT / "host/nondum/host",
    "nondum.cli": ROOT / "host/nondum/cli",
}


def modules(portion: str) -> Iterator[Path]:
    """A portion's modules; the text that new plugins are made from is none."""
    return (p for p in PORTIONS[portion].rglob("*.py") if "template" not in p.parts)


@cache
def imported_names(path: Path) -> tuple[str, ...]:
    """Full names of what a module imports: `package.name` for each name of a `from`."""
    found: list[str] = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            found += (f"{node.module}.{alias.name}" for alias in node.names)
    return tuple(found)


def imports(portion: str) -> dict[str, set[str]]:
    """Package (or module outside of any) → those that it imports, by their names in the portion."""
    found: dict[str, set[str]] = {}
    known = {_second(path, portion) for path in modules(portion)} - {"__init__"}
    for path in modules(portion):
        here = _second(path, portion)
        if here != "__init__":
            there = (name.split(".") for name in imported_names(path))
            near = {parts[2] for parts in there if ".".join(parts[:2]) == portion and parts[2:]}
            found.setdefault(here, set()).update(near & known - {here})
    return found


def layers(graph: Mapping[str, set[str]]) -> list[list[str]]:
    """Packages in layers, innermost first: each imports those of layers before it alone.

    Raises `graphlib.CycleError`.
    """
    order: TopologicalSorter[str] = TopologicalSorter(graph)
    order.prepare()
    found = []
    while order.is_active():
        ready = sorted(order.get_ready())
        found.append(ready)
        order.done(*ready)
    return found


def reduced(graph: Mapping[str, set[str]]) -> dict[str, set[str]]:
    """The graph without arrows that follow from others (its transitive reduction)."""
    reach: dict[str, set[str]] = {}
    for layer in layers(graph):
        for name in layer:
            reach[name] = graph[name].union(*(reach[near] for near in graph[name]))
    return {
        name: {one for one in near if not any(one in reach[other] for other in near)}
        for name, near in graph.items()
    }


def _second(path: Path, portion: str) -> str:
    return path.relative_to(PORTIONS[portion]).with_suffix("").parts[0]
