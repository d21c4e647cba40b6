"""Who plays a part in the running plan, and who else could: read off the host's tree. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Choice:
    """A step that more than one component could do."""

    component: str
    """The one that was chosen."""
    others: tuple[str, ...]
    why: str
    """The host's reason."""
    cost: int
    others_cost: int
    """Of the cheapest of them."""

    def __str__(self) -> str:
        return f"{self.component} instead of {', '.join(self.others)} ({self.why})"


def choices(tree: Mapping[str, Any]) -> Iterator[Choice]:
    """Every step of a tree that had alternatives."""
    if others := tree.get("step", {}).get("chosen", {}).get("instead_of"):
        step = tree["step"]
        names = tuple(str(row["component"]) for row in others)
        costs = step["chosen"]["cost"], min(row["cost"] for row in others)
        yield Choice(str(step["component"]), names, step["chosen"]["why"], *costs)
    for child in tree["children"]:
        yield from choices(child)
