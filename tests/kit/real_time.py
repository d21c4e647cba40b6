"""Where a text of Python waits for real time, or judges by it.

Three things are looked for: `time.sleep`, `asyncio.sleep` of more than nothing, and assertions on
differences of clocks. What a test does in virtual time (fixture `clock`) is no such thing.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum

CLOCKS = frozenset(
    f"time.{name}{unit}"
    for name in ("monotonic", "perf_counter", "process_time", "thread_time", "time")
    for unit in ("", "_ns")
)
LOOP_TIME = "loop.time"
SLEEPS = {
    "time.sleep": "time.sleep",
    "asyncio.sleep": "asyncio.sleep",
    "anyio.sleep": "asyncio.sleep",
}
CLOCK_ASSERTED = "assert on a clock"
CLOCK_FIXTURE = "clock"

_WORTH_READING = re.compile(r"\bsleep\b|\bimport .*\btime\b|\bfrom time\b|\.time\(")
_Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True, order=True, slots=True)
class Finding:
    """One place that waits or judges."""

    where: str
    """Function in its classes and functions, by dots; empty for a module."""
    what: str
    line: int


class Kind(IntEnum):
    """What a value has to do with clocks."""

    NONE = 0
    POINT = 1
    """Read from a clock: may be put in an order."""
    DIFFERENCE = 2
    """Reckoned with what was read."""


def findings(text: str) -> list[Finding]:
    """All of a module."""
    if not _WORTH_READING.search(text):
        return []
    tree = ast.parse(text)
    return sorted(set(_Reader(_imported(tree)).read(tree)))


def _imported(tree: ast.Module) -> dict[str, str]:
    """Full names of what is imported, by the name that it has here."""
    names: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.asname or alias.name: alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                names[alias.asname or alias.name] = f"{node.module}.{alias.name}"
    return names


class _Reader:
    """Reads a module; knows which of its names hold what clocks said."""

    def __init__(self, imported: Mapping[str, str]) -> None:
        self._imported = imported
        self._kinds: dict[str, Kind] = {}
        """Of variables and functions, by scope and name."""

    def read(self, tree: ast.Module) -> Iterator[Finding]:
        while self._learn(tree):
            pass
        yield from self._found(tree, (), is_virtual=False)

    def _found(
        self, node: ast.AST, scope: tuple[str, ...], *, is_virtual: bool
    ) -> Iterator[Finding]:
        if isinstance(node, _Function):
            is_virtual |= CLOCK_FIXTURE in _parameters(node)
        inner = _inner(node, scope)
        if what := self._what(node, inner, is_virtual=is_virtual):
            yield Finding(".".join(scope), what, getattr(node, "lineno", 0))
        for child in ast.iter_child_nodes(node):
            yield from self._found(child, inner, is_virtual=is_virtual)

    def _what(self, node: ast.AST, scope: tuple[str, ...], *, is_virtual: bool) -> str:
        if isinstance(node, ast.Assert) and self._kind(node.test, scope) is Kind.DIFFERENCE:
            return "" if is_virtual and not self._reads_clock(node) else CLOCK_ASSERTED
        if isinstance(node, ast.Attribute | ast.Name) and self._name(node) == "time.sleep":
            return SLEEPS["time.sleep"]
        if isinstance(node, ast.Call) and (what := SLEEPS.get(self._name(node.func), "")):
            is_wait = node.args and not _is_nothing(node.args[0]) and not is_virtual
            return what if is_wait else ""
        return ""

    def _reads_clock(self, node: ast.AST) -> bool:
        return any(self._name(one) in CLOCKS for one in ast.walk(node))

    def _learn(self, tree: ast.Module) -> bool:
        """Follow what clocks say into names, once; whether that taught anything."""
        before = dict(self._kinds)
        self._learn_in(tree, ())
        return self._kinds != before

    def _learn_in(self, node: ast.AST, scope: tuple[str, ...]) -> None:
        inner = _inner(node, scope)
        match node:
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    self._give(target, self._kind(value, scope), scope)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._give(target, self._kind(value, scope), scope)
            case (
                ast.AugAssign(target=target, value=value)
                | ast.NamedExpr(target=target, value=value)
            ):
                self._give(target, self._kind(value, scope), scope)
            case ast.For(target=target, iter=value) | ast.comprehension(target=target, iter=value):
                self._give(target, self._kind(value, scope), scope)
            case ast.Call(func=ast.Attribute(value=owner, attr="append" | "add"), args=[value]):
                self._give(owner, self._kind(value, scope), scope)
            case ast.Return(value=ast.expr() as value):
                *outer, name = scope
                self._raise_to(".".join((*outer, name)), self._kind(value, scope))
        for child in ast.iter_child_nodes(node):
            self._learn_in(child, inner)

    def _give(self, target: ast.expr, kind: Kind, scope: tuple[str, ...]) -> None:
        match target:
            case ast.Tuple(elts=parts) | ast.List(elts=parts):
                for part in parts:
                    self._give(part, kind, scope)
            case ast.Name(id=name):
                self._raise_to(".".join((*scope, name)), kind)
            case ast.Attribute(attr=name):
                self._raise_to(f".{name}", kind)

    def _raise_to(self, name: str, kind: Kind) -> None:
        if kind > self._kinds.get(name, Kind.NONE):
            self._kinds[name] = kind

    def _kind(self, node: ast.AST, scope: tuple[str, ...]) -> Kind:
        """Of an expression: of what it is made, and one more where it is reckoned with."""
        if isinstance(node, ast.Lambda):
            return Kind.NONE
        parts = [self._kind(child, scope) for child in ast.iter_child_nodes(node)]
        made_of = max(parts, default=Kind.NONE)
        if isinstance(node, ast.BinOp) and made_of is Kind.POINT:
            return Kind.DIFFERENCE
        if isinstance(node, ast.Call) and self._name(node.func) in {*CLOCKS, LOOP_TIME}:
            return Kind.POINT
        if isinstance(node, ast.Name):
            return self._of_name(node.id, scope)
        if isinstance(node, ast.Attribute):
            return max(made_of, self._kinds.get(f".{node.attr}", Kind.NONE))
        return made_of

    def _of_name(self, name: str, scope: tuple[str, ...]) -> Kind:
        """By the innermost scope that knows it."""
        for end in range(len(scope), -1, -1):
            if kind := self._kinds.get(".".join((*scope[:end], name)), Kind.NONE):
                return kind
        return Kind.NONE

    def _name(self, node: ast.AST) -> str:
        match node:
            case ast.Name(id=name):
                return self._imported.get(name, name)
            case ast.Attribute(value=ast.Call(func=owner), attr="time") if self._name(owner) in {
                "asyncio.get_running_loop",
                "asyncio.get_event_loop",
            }:
                return LOOP_TIME
            case ast.Attribute(value=value, attr=attr):
                return f"{self._name(value)}.{attr}"
        return ""


def _inner(node: ast.AST, scope: tuple[str, ...]) -> tuple[str, ...]:
    return (*scope, node.name) if isinstance(node, _Function | ast.ClassDef) else scope


def _parameters(node: _Function) -> set[str]:
    return {one.arg for one in (*node.args.args, *node.args.kwonlyargs)}


def _is_nothing(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value == 0
