"""The steps of verification: every condition under which something foreign is refused.

A step is the condition of an `if`, or the guard of a `case`, whose body does nothing but refuse: it
raises, tells a problem, or returns what is wrong. Of `a or b` each is a step of its own. Without
the step, the condition never holds.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

_TELLS = re.compile(r"(^|_)(problem|refuse|refused|flaw|violation|malformed|add|unsafe|refusal)s?$")
"""What a function or class is called that makes or tells a problem."""


@dataclass(frozen=True, slots=True)
class Step:
    """A condition, and where its test stands in the text."""

    module: str
    """Path from the root of the checkout."""
    line: int
    condition: str
    start: int
    end: int
    """In characters of the module's text."""

    @property
    def name(self) -> str:
        """What it is called in lists: `wheelhouse/…/lock.py:12`."""
        return f"{self.module}:{self.line}"

    def removed(self, text: str) -> str:
        """The module without this step."""
        return f"{text[: self.start]}False{text[self.end :]}"


def steps_of(module: str, text: str) -> tuple[Step, ...]:
    """Every step of a module, in order.

    >>> steps_of("m.py", "if a > 1:\\n    raise Refused()\\n")[0].removed("if a > 1: …")
    'if False: …'
    """
    starts = _line_starts(text)
    found = []
    for test in _conditions(ast.parse(text)):
        start, end = _span(test, starts, text)
        condition = " ".join(text[start:end].split())
        found.append(Step(module, test.lineno, condition, start, end))
    return tuple(sorted(found, key=lambda step: step.start))


def steps_in(root: Path, modules: Sequence[str]) -> tuple[Step, ...]:
    """The steps of many modules."""
    return tuple(
        step
        for module in modules
        for step in steps_of(module, (root / module).read_text(encoding="utf-8"))
    )


def _conditions(tree: ast.AST) -> Iterator[ast.expr]:
    for node in ast.walk(tree):
        match node:
            case ast.If(test=test, body=body) if _refuses(body):
                yield from _alternatives(test)
            case ast.match_case(guard=ast.expr() as guard, body=body) if _refuses(body):
                yield from _alternatives(guard)


def _alternatives(test: ast.expr) -> Iterator[ast.expr]:
    """Each of the conditions that suffices by itself."""
    if isinstance(test, ast.BoolOp) and isinstance(test.op, ast.Or):
        for value in test.values:
            yield from _alternatives(value)
    else:
        yield test


def _refuses(body: Sequence[ast.stmt]) -> bool:
    """Whether a body ends in a refusal, with nothing before it but words."""
    *before, last = body
    return all(isinstance(one, ast.Assign) for one in before) and _is_refusal(last)


def _is_refusal(statement: ast.stmt) -> bool:
    match statement:
        case ast.Raise(exc=ast.expr()):
            return True
        case ast.Return(value=ast.Constant(value=str(said))):
            return bool(said)
        case ast.Return(value=ast.JoinedStr()):
            return True
        case ast.Return(value=ast.expr() as value) | ast.Expr(value=ast.expr() as value):
            return any(_TELLS.search(name) for name in _called(value))
    return False


def _called(value: ast.expr) -> Iterator[str]:
    for node in ast.walk(value):
        match node:
            case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)):
                yield name.lower()


def _span(node: ast.expr, starts: Sequence[int], text: str) -> tuple[int, int]:
    """Where an expression stands, in characters; the parser counts UTF-8 bytes."""
    assert node.end_lineno is not None and node.end_col_offset is not None
    return (
        _offset(node.lineno, node.col_offset, starts, text),
        _offset(node.end_lineno, node.end_col_offset, starts, text),
    )


def _offset(line: int, column: int, starts: Sequence[int], text: str) -> int:
    start = starts[line - 1]
    end = starts[line] if line < len(starts) else len(text)
    return start + len(text[start:end].encode()[:column].decode())


def _line_starts(text: str) -> list[int]:
    return [0, *(match.end() for match in re.finditer("\n", text))]
