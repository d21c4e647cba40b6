"""What is fuzzed: a reader of bytes that somebody else has made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

LONGEST = 8 * 1024
Read = Callable[[bytes], object]


@dataclass(frozen=True, slots=True)
class Target:
    """A reader, and what it has to be given to get far into it."""

    name: str
    read: Read
    """Takes any bytes: gives a value, or raises an error of nondum's own tree and nothing else."""
    seeds: Callable[[], list[bytes]]
    """Inputs that it accepts: what mutation starts from."""
    refused: Callable[[], list[bytes]] = list
    """Inputs that it does not accept, to start from as well."""
    tokens: tuple[bytes, ...] = ()
    """Pieces that mean something to it."""
    cases: int = 200_000
    """How many inputs the long run makes."""
    longest: int = LONGEST
    """Bytes of the longest input."""
