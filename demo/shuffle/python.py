"""Python source of a plugin in new names: string literals by their part, imports by package.

A literal that is exactly a declared name is that name, except where the SDK expects a word of
another kind: a type, a predicate, or what people say.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from demo.shuffle.names import Names
from demo.shuffle.package import Table
from demo.shuffle.pddl import Part
from demo.shuffle.vocabulary import declared, spoken

_TYPED = frozenset({"Unit", "Output", "Input"})
_FACTUAL = frozenset({"know", "forget", "value"})


@dataclass(frozen=True, slots=True)
class Literals:
    """What the string literals of a package may be."""

    names: frozenset[str] = frozenset()
    signatures: frozenset[str] = frozenset()
    goals: frozenset[str] = frozenset()
    patterns: frozenset[str] = frozenset()

    @classmethod
    def of(cls, said: Table) -> Literals:
        """What a plugin's description says."""
        words = (t.text for part, t in spoken(said) if part not in (Part.DOMAIN, Part.ACTION))
        phrases = said["phrases"]
        return cls(
            names=frozenset({*declared(said), *words}),
            signatures=frozenset(b["action"] for b in said["behaviours"]),
            goals=frozenset(phrase["goal"] for phrase in phrases),
            patterns=frozenset(
                {p["pattern"] for p in phrases}.union(*(b["phrases"] for b in said["behaviours"]))
            ),
        )

    def __or__(self, other: Literals) -> Literals:
        return Literals(
            self.names | other.names,
            self.signatures | other.signatures,
            self.goals | other.goals,
            self.patterns | other.patterns,
        )


def rewritten(source: str, literals: Literals, names: Names) -> str:
    """The module's source in new names."""
    return _packages_renamed(_literals_renamed(source, literals, names), names)


def _packages_renamed(source: str, names: Names) -> str:
    for old, new in names.packages.items():
        source = re.sub(rf"\b{re.escape(old)}\b", new, source)
    return source


def _literals_renamed(source: str, literals: Literals, names: Names) -> str:
    lines = source.encode().splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))
    whole, done = b"".join(lines), 0
    pieces: list[bytes] = []
    for node, rename in sorted(_renames(ast.parse(source), literals, names), key=_position):
        new = rename(str(node.value))
        if new != node.value:
            begin = starts[node.lineno - 1] + node.col_offset
            pieces += [whole[done:begin], repr(new).encode()]
            assert node.end_lineno is not None and node.end_col_offset is not None
            done = starts[node.end_lineno - 1] + node.end_col_offset
    return b"".join([*pieces, whole[done:]]).decode()


Rename = Callable[[str], str]
_Renamed = tuple[ast.Constant, Rename]


def _position(renamed: _Renamed) -> tuple[int, int]:
    return renamed[0].lineno, renamed[0].col_offset


def _renames(tree: ast.AST, literals: Literals, names: Names) -> Iterator[_Renamed]:
    parts = dict(_parts(tree))

    def as_name(text: str) -> str:
        for known, rename in (
            (literals.signatures, names.signature),
            (literals.goals, names.formula),
            (literals.patterns, names.pattern),
            (literals.names, lambda name: names.words.get(name, name)),
        ):
            if text in known:
                return rename(text)
        return names.components.get(text) or names.files.get(text, text)

    for node in _strings(tree):
        part = parts.get(node, Part.OBJECT)
        if part is Part.OBJECT:
            yield node, as_name
        elif part is not None:
            yield node, _own(names, part)


def _own(names: Names, part: Part) -> Rename:
    def rename(text: str) -> str:
        return text if names.core.has(part, text) else names.words.get(text, text)

    return rename


def _strings(tree: ast.AST) -> Iterator[ast.Constant]:
    """The string literals that are no docstrings; f-strings are left alone whole."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node
        elif not isinstance(node, ast.JoinedStr) and not _is_docstring(node):
            yield from _strings(node)


def _is_docstring(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _parts(tree: ast.AST) -> Iterator[tuple[ast.AST, Part | None]]:
    """The part of literals that stand in known places; None: words that stay as people say them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name == "labels":
            yield from ((inner, None) for inner in ast.walk(node))
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield from _call_parts(node)


def _call_parts(call: ast.Call) -> Iterator[tuple[ast.AST, Part | None]]:
    called = call.func.attr if isinstance(call.func, ast.Attribute) else ""
    called = call.func.id if isinstance(call.func, ast.Name) else called
    keywords = {keyword.arg: keyword.value for keyword in call.keywords}
    if called in _TYPED:
        yield from ((node, Part.TYPE) for node in (*call.args[1:2], keywords.get("type")) if node)
    elif called == "Label":
        yield from (
            (node, Part.OBJECT) for node in (*call.args[:1], keywords.get("object")) if node
        )
    elif called == "DeviceNeed":
        yield from ((inner, None) for node in call.args[1:] for inner in ast.walk(node))
    elif called in _FACTUAL:
        yield from ((node, Part.PREDICATE) for node in call.args[:1])
    elif called == "condition" and "predicates" in keywords:
        yield from ((node, Part.PREDICATE) for node in ast.walk(keywords["predicates"]))
