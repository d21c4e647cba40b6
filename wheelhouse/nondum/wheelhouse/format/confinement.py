"""Levels of confinement: how much of its host a worker is kept from."""

from __future__ import annotations

import enum
import functools
from collections.abc import Mapping


@functools.total_ordering
class Level(enum.Enum):
    """A level, by the name that is shown and written. The later one confines more."""

    NONE = "none"
    """Resource limits and no new privileges; nothing else."""
    RESTRICTED = "restricted"
    """What a process can give up by itself: files (Landlock), system calls (seccomp), and, where
    the host is root, root's user id."""
    SANDBOXED = "sandboxed"
    """Namespaces with an empty root folder (bubblewrap), beside filtered system calls."""

    def __str__(self) -> str:
        return self.value

    def __lt__(self, other: Level) -> bool:
        levels = list(Level)
        return levels.index(self) < levels.index(other)


NUMBERS: Mapping[int, Level] = {
    0: Level.NONE,
    1: Level.RESTRICTED,
    2: Level.SANDBOXED,
    3: Level.SANDBOXED,
}
"""Levels by the numbers that stood for them first, and still may. There were four."""
EXPECTED = '"sandboxed", "restricted" or "none"'
_NAMES = {level.value: level for level in Level} | {str(n): each for n, each in NUMBERS.items()}


def parse(value: object) -> Level:
    """Read a level by its name or its number, which may be text.

    Raises `ValueError`, which says what is expected.

    >>> [str(parse(value)) for value in ("restricted", 0, 2, "3")]
    ['restricted', 'none', 'sandboxed', 'sandboxed']
    """
    found = None
    if isinstance(value, str):
        found = _NAMES.get(value)
    elif type(value) is int:  # true and false are no levels
        found = NUMBERS.get(value)
    if found is None:
        raise ValueError(f"expected {EXPECTED}")
    return found
