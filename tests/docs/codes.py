"""Every code that a refusal may carry, with its words, as the sources have them."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
ROOMS = {
    "Payloads and drives": ("wheelhouse/nondum", "host/nondum/host/drives"),
    "The host": ("host/nondum/host",),
    "Workers, links and streams": (
        "plugins/sdk/nondum",
        "transport/nondum",
        "host/nondum/host/workers",
    ),
}
"""Heading → folders. Planning's codes stand in fragments.md."""
CODE = re.compile(r"[A-Z][A-Z0-9]+(_[A-Z0-9]+)*")
TELLERS = re.compile(r"Problem|problem|_(refuse|refused|flaw|short|violation|told|failure)")
"""What makes a problem: the class itself, or a function of the module that fills it in."""
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@dataclass(frozen=True)
class Told:
    """One place where a code is given."""

    room: str
    code: str
    words: str
    """The message, `…` for what differs; empty where it is put together elsewhere."""
    remedy: str


def references() -> str:
    """A section a room, a row a code."""
    rows: dict[str, dict[str, list[Told]]] = {room: defaultdict(list) for room in ROOMS}
    for told in all_told():
        rows[told.room][told.code].append(told)
    return "\n".join(_section(room, found) for room, found in rows.items())


def all_told() -> Iterator[Told]:
    """Every place, by file; a file belongs to the room with the nearest folder."""
    for path in sorted({p for folders in ROOMS.values() for f in folders for p in _modules(f)}):
        said = path.relative_to(ROOT).as_posix()
        room = max(ROOMS, key=lambda room: max(_nearness(said, f) for f in ROOMS[room]))
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for scope in [tree, *(node for node in ast.walk(tree) if isinstance(node, FUNCTIONS))]:
            yield from _told_in(list(_inside(scope)), room)


def _inside(scope: ast.AST) -> Iterator[ast.AST]:
    """What is in a function (or, for a module, in none), in the order of the text."""
    for node in ast.iter_child_nodes(scope):
        if not isinstance(node, FUNCTIONS):
            yield node
            yield from _inside(node)


def _modules(folder: str) -> Iterator[Path]:
    return (p for p in (ROOT / folder).rglob("*.py") if "template" not in p.parts)


def _nearness(path: str, folder: str) -> int:
    return len(folder) if path.startswith(f"{folder}/") else 0


def _told_in(nodes: Sequence[ast.AST], room: str) -> Iterator[Told]:
    named: dict[str, str] = {}
    for node in nodes:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            named[node.targets[0].id] = _words(node.value, named)
        if not isinstance(node, ast.Call) or not TELLERS.fullmatch(_name(node.func)):
            continue
        code = _words(node.args[0], named) if node.args else ""
        if CODE.fullmatch(code):
            said = (_words(argument, named) for argument in node.args[1:])
            fixes = [k.value for k in node.keywords if k.arg == "fix"]
            remedy = _words(fixes[0], named) if fixes else ""
            yield Told(room, code, next((w for w in said if " " in w), ""), remedy)


def _name(function: ast.expr) -> str:
    return function.id if isinstance(function, ast.Name) else getattr(function, "attr", "")


def _words(node: ast.expr, named: Mapping[str, str]) -> str:
    """A string as it is written, with `…` for each of its parts that differ."""
    match node:
        case ast.Constant(str(text)):
            return text
        case ast.JoinedStr(values):
            return "".join(_words(v, named) if isinstance(v, ast.Constant) else "…" for v in values)
        case ast.Name(id):
            return named.get(id, "")
    return ""


def _section(room: str, found: Mapping[str, list[Told]]) -> str:
    heads = [f"## {room}\n", "| code | what is said | what to do |", "|---|---|---|"]
    return "\n".join([*heads, *(_row(code, found[code]) for code in sorted(found)), ""])


def _row(code: str, places: list[Told]) -> str:
    words, remedies = ({getattr(p, name): None for p in places} for name in ("words", "remedy"))
    cells = ("; or: ".join(filter(None, said)).replace("|", r"\|") for said in (words, remedies))
    return f"| `{code}` | {' | '.join(cells)} |"
