"""A reader of the DOT language (https://graphviz.org/doc/info/lang.html), as strict as Graphviz."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

_TOKEN = re.compile(
    r"""\s*(?:(?P<text>"(?:[^"\\]|\\.)*")|(?P<name>[A-Za-z_][A-Za-z0-9_]*|-?\d+(?:\.\d+)?)"""
    r"""|(?P<mark>->|[{}\[\];,=]))""",
    re.DOTALL,
)


@dataclass
class Graph:
    """What a text says: nodes with their attributes, and edges with theirs."""

    nodes: dict[str, dict[str, str]] = field(default_factory=dict)
    edges: list[tuple[str, str, dict[str, str]]] = field(default_factory=list)


def read_dot(text: str) -> Graph:
    """Read one directed graph. Raises `ValueError` where Graphviz would find a syntax error."""
    tokens = list(_tokens(text))
    reader = _Reader(tokens)
    graph = reader.graph()
    if reader.left:
        raise ValueError(f"{reader.left[0]!r} after the graph")
    return graph


def _tokens(text: str) -> Iterator[str]:
    place = 0
    while place < len(text.rstrip()):
        found = _TOKEN.match(text, place)
        if found is None:
            raise ValueError(f"no token at {text[place : place + 20]!r}")
        yield found.group().strip()
        place = found.end()


class _Reader:
    def __init__(self, tokens: list[str]) -> None:
        self.left = tokens

    def graph(self) -> Graph:
        graph = Graph()
        self._expect("digraph")
        self._id()
        self._expect("{")
        while self.left[:1] != ["}"]:
            self._statement(graph)
        self._expect("}")
        return graph

    def _statement(self, graph: Graph) -> None:
        name = self._id()
        if self.left[0] == "->":
            self._expect("->")
            graph.edges.append((name, self._id(), self._attributes()))
        elif name in ("graph", "node", "edge"):
            self._attributes()
        else:
            graph.nodes[name] = self._attributes()
        self._expect(";")

    def _attributes(self) -> dict[str, str]:
        found: dict[str, str] = {}
        if self.left[0] != "[":
            return found
        self._expect("[")
        while self.left[0] != "]":
            name = self._id()
            self._expect("=")
            found[name] = self._id()
            if self.left[0] == ",":
                self._expect(",")
        self._expect("]")
        return found

    def _id(self) -> str:
        token = self.left.pop(0)
        if token.startswith('"'):
            return re.sub(r"\\(.)", lambda m: "\n" if m[1] == "n" else m[1], token[1:-1])
        if not re.fullmatch(r"\w+|-?\d+(\.\d+)?", token):
            raise ValueError(f"{token!r} is no name")
        return token

    def _expect(self, token: str) -> None:
        if not self.left or self.left.pop(0) != token:
            raise ValueError(f"expected {token!r} before {self.left[:5]}")
