"""Values of the host as JSON can carry them: events, records, what a job answers."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem

Row: TypeAlias = dict[str, Any]
"""One row of a table: plain data for tools."""


def plain(value: Any) -> Any:
    """A value as JSON can carry it.

    >>> plain((Path("/media/a"), frozenset({"b"})))
    ['/media/a', ['b']]
    """
    if isinstance(value, Problem | PluginDescription):
        return value.to_dict()
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, frozenset):
        return sorted(plain(item) for item in value)
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    return value
