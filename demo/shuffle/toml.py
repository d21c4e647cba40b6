"""TOML text of plain tables: as much of it as a manifest and a project file need."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any


def text(table: Mapping[str, Any]) -> str:
    """A document that `tomllib` reads back as the same table.

    >>> print(text({"a": 1, "b": {"c d": ["x", True]}, "e": [{"f": {}}]}), end="")
    a = 1
    [b]
    "c d" = ["x", true]
    [[e]]
    [e.f]
    """
    return "".join(f"{line}\n" for line in _lines(table, ()))


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    for key, value in table.items():
        if not isinstance(value, Mapping) and not _is_tables(value):
            yield f"{_key(key)} = {_value(value)}"
    for key, value in table.items():
        below = (*path, key)
        header = ".".join(map(_key, below))
        if isinstance(value, Mapping):
            if not value or not all(isinstance(inner, Mapping) for inner in value.values()):
                yield f"[{header}]"
            yield from _lines(value, below)
        elif _is_tables(value):
            for entry in value:
                yield f"[[{header}]]"
                yield from _lines(entry, below)


def _is_tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, Mapping) for v in value)


def _key(key: str) -> str:
    return key if key.replace("-", "").replace("_", "").isalnum() and key.isascii() else _value(key)


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    # Strings, numbers and truth values are written as in JSON.
    return json.dumps(value, ensure_ascii=False)
