"""Where each table and key of a TOML file stands: what tomllib does not say."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from functools import cached_property
from io import StringIO
from typing import Any

Path = tuple[str, ...]
DEEPEST = 2
"""Tables, and keys of tables: what the configuration has."""


def places(text: str) -> dict[Path, int]:
    r"""The first line of every table and key of a text that is TOML, counted from one.

    >>> places("a = 1\n[b]\n\nc = [\n1]\n")
    {('a',): 1, ('b',): 2, ('b', 'c'): 4}
    """
    found: dict[Path, int] = {}
    table: Path = ()
    for line, statement in _statements(text):
        paths = list(_paths(tomllib.loads(statement)))
        if statement.lstrip().startswith("["):
            table = max(paths, key=len)
            below = paths
        else:
            below = [table + path for path in paths]
        for path in below:
            found.setdefault(path[:DEEPEST], line)
    return found


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Each header and assignment with its first line. It ends as soon as it is TOML by itself."""
    begun: list[str] = []
    first = 0
    for number, line in enumerate(StringIO(text, newline="\n"), start=1):
        if not begun and (not line.strip() or line.lstrip().startswith("#")):
            continue
        first = first if begun else number
        begun.append(line)
        statement = "".join(begun)
        try:
            tomllib.loads(statement)
        except tomllib.TOMLDecodeError:
            continue
        yield first, statement
        begun = []


def _paths(data: Mapping[str, Any], above: Path = ()) -> Iterator[Path]:
    for key, value in data.items():
        yield (*above, key)
        inner = value[-1] if isinstance(value, list) and value else value
        if isinstance(inner, dict):
            yield from _paths(inner, (*above, key))


class Places:
    """Where things stand in one file; nothing is read before somebody asks."""

    def __init__(self, file: str, text: str) -> None:
        """`text` is TOML: what was parsed."""
        self._file, self._text = file, text

    @cached_property
    def _lines(self) -> Mapping[Path, int]:
        return places(self._text)

    def of(self, *path: str) -> str:
        """`file:line` of a table, or of a key in one; the file, if that is not in it.

        >>> Places("host.toml", "[host]\\nname = 'spot'").of("host", "name")
        'host.toml:2'
        """
        line = self._lines.get(path)
        return self._file if line is None else f"{self._file}:{line}"

    def has(self, *path: str) -> bool:
        """Whether a table, or a key in one, is in the file."""
        return path in self._lines
