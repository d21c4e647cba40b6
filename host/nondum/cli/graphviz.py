"""A behaviour tree in the DOT language of Graphviz (https://graphviz.org/doc/info/lang.html).

Solid lines are the tree, dashed ones causal links: which fact a step gives to which other one.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping
from itertools import count
from typing import Any

from nondum.cli.outline import by_step, step_details
from nondum.host.core.printable import printable

Node = Mapping[str, Any]

LABEL_WIDTH = 32
"""Characters that a box is wide."""

COLOURS = {
    "SUCCESS": "palegreen",
    "FAILURE": "salmon",
    "RUNNING": "khaki",
    "INVALID": "white",
    "done": "palegreen",
    "skipped": "honeydew",
    "running": "khaki",
    "kept": "lightcyan",
    "halting": "plum",
    "next": "lightyellow",
    "waiting": "white",
    "excluded": "salmon",
}
SHAPES = {"Parallel": "parallelogram", "Selector": "octagon", "Sequence": "box"}


def graphviz(root: Node) -> str:
    """The tree as one DOT graph."""
    lines = [
        "digraph nondum {",
        '  graph [rankdir="TB", ordering="out", fontname="sans-serif"];',
        '  node [shape="box", style="filled,rounded", fontname="sans-serif", fontsize="10"];',
        '  edge [fontname="sans-serif", fontsize="8"];',
        *_node_lines(root, count()),
        "}",
    ]
    return "\n".join(lines) + "\n"


def _node_lines(node: Node, numbers: Iterator[int]) -> Iterator[str]:
    """A node, all below it, and the causal links among its steps."""
    own = f"n{next(numbers)}"
    yield _box(own, node)
    names: dict[int, str] = {}
    for child in node["children"]:
        lines = list(_node_lines(child, numbers))
        name = lines[0].split()[0]
        if step := child.get("step"):
            names[step["number"]] = name
        yield from lines
        yield f"  {own} -> {name};"
    yield from _links(own, node, names)


def _box(name: str, node: Node) -> str:
    step = node.get("step")
    state = step["state"] if step else node["status"]
    attributes = {
        "label": _label(node, step),
        "tooltip": _tooltip(node, step),
        "fillcolor": COLOURS.get(state, "white"),
    }
    if node["kind"] in SHAPES:
        attributes["shape"] = SHAPES[node["kind"]]
    return f"  {name} [{_listed(attributes)}];"


def _label(node: Node, step: Node | None) -> str:
    if step:
        return f"{step['number']} {step['schema']}\n{step['state']}"
    return f"{node['name']}\n{node['status']}"


def _tooltip(node: Node, step: Node | None) -> str:
    details = [f"{label}: {text}" for label, text in step_details(step)] if step else []
    return "\n".join(filter(None, [str(node["why"]), *details])) or str(node["name"])


def _links(own: str, node: Node, names: Mapping[int, str]) -> Iterator[str]:
    for child in node["children"]:
        step = child.get("step")
        for number, facts in by_step(step["needed_by"] if step else ()):
            taker = own if number is None else names[number]
            look = {"style": "dashed", "constraint": "false", "label": facts}
            yield f"  {names[step['number']]} -> {taker} [{_listed(look)}];"


def _listed(attributes: Mapping[str, str]) -> str:
    return ", ".join(f"{name}={quoted(text)}" for name, text in attributes.items())


def quoted(text: str) -> str:
    r"""A DOT string. In labels a backslash would begin an escape, so it is doubled.

    >>> print(quoted('say "hi"'))
    "say \"hi\""
    """
    lines = [part for line in text.split("\n") for part in _folded(printable(line))]
    escaped = "\\n".join(line.replace("\\", "\\\\").replace('"', '\\"') for line in lines)
    return f'"{escaped}"'


def _folded(line: str) -> list[str]:
    return textwrap.wrap(line, LABEL_WIDTH, break_on_hyphens=False, break_long_words=False) or [""]
