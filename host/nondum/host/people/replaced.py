"""What people are told of goals that another one takes the place of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any


def replacing(rows: Iterable[Mapping[str, Any]]) -> str:
    """A sentence on the goals that a goal `replaces` (a column of its row); empty: it does not.

    >>> replacing([{"id": "1", "text": "follow me", "is_over": False}])
    "it replaces goal 1, 'follow me', if they need the same"
    >>> replacing([{"id": "1", "text": "follow me", "is_over": True}])
    "it has replaced goal 1, 'follow me'"
    """
    groups: dict[bool, list[str]] = {True: [], False: []}
    for row in rows:
        groups[row["is_over"]].append(f"goal {row['id']}, {row['text']!r}")
    parts = []
    if groups[True]:
        parts.append(f"it has replaced {' and '.join(groups[True])}")
    if groups[False]:
        waiting = " and ".join(groups[False])
        parts.append(f"it replaces {waiting}, if they need the same")
    return "; ".join(parts)
