"""What lark makes of the grammar, made beforehand: to read it takes a tenth of making it.

`python -m tests.docs.reference` writes it. Tables of another grammar, or of another lark, are made
when they are needed, as if there were none.
"""

from __future__ import annotations

import json
from hashlib import sha256
from importlib import resources
from importlib.resources.abc import Traversable
from typing import Any

import lark
from lark.grammar import Rule
from lark.lexer import TerminalDef

FOLDER: Traversable = resources.files(__package__) / "grammar"
GRAMMAR, TABLES = "pddl.lark", "pddl.tables.json"
_OPTIONS: dict[str, Any] = {
    "parser": "lalr",
    "start": ["fragment", "formula", "signature"],
    "maybe_placeholders": False,
}


def parser_of(transformer: lark.Transformer[Any, Any], folder: Traversable = FOLDER) -> lark.Lark:
    """The parser of PDDL; it builds by `transformer` while it parses, which spares it a tree."""
    grammar, kept = _grammar(folder), _kept(folder)
    if kept["of"] != _of(grammar):
        return lark.Lark(grammar, **_OPTIONS, transformer=transformer)
    # As parsers do that `lark.tools.standalone` writes, which are of one lark as these tables are.
    load: Any = lark.Lark._load_from_dict
    found: lark.Lark = load(
        _numbered(kept["data"]), _numbered(kept["memo"]), transformer=transformer
    )
    return found


def are_current() -> bool:
    """Whether the tables are of this grammar and of the lark that is here."""
    return bool(_kept(FOLDER)["of"] == _of(_grammar(FOLDER)))


def made() -> str:
    """The text of `TABLES`, made again. Numbers in it differ each time, and mean the same."""
    grammar = _grammar(FOLDER)
    parser: Any = lark.Lark(grammar, **_OPTIONS)
    data, memo = parser.memo_serialize([TerminalDef, Rule])
    kept = {"of": _of(grammar), "data": data, "memo": memo}
    return json.dumps(kept, separators=(",", ":")) + "\n"


def _grammar(folder: Traversable) -> str:
    return (folder / GRAMMAR).read_text(encoding="utf-8")


def _kept(folder: Traversable) -> dict[str, Any]:
    kept: dict[str, Any] = json.loads((folder / TABLES).read_text(encoding="utf-8"))
    return kept


def _of(grammar: str) -> dict[str, str]:
    return {"lark": lark.__version__, "grammar": sha256(grammar.encode()).hexdigest()}


def _numbered(value: Any) -> Any:
    """With keys that are numbers, which in JSON they cannot be."""
    if isinstance(value, list):
        return [_numbered(one) for one in value]
    if isinstance(value, dict):
        return {int(k) if k.isdigit() else k: _numbered(one) for k, one in value.items()}
    return value
