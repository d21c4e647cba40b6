"""What is fuzzed: a reader of bytes that somebody else has made."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

LONGEST = 8 * 1024
Read = Callable[[bytes], object]
ENDLESS_NUMBER = b"9" * 5_000
"""Python makes an `int` of 4,300 digits at most, and raises `ValueError` on more."""


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


def of_text(read: Callable[[str], object]) -> Callable[[bytes], object]:
    """A reader of text, which is not asked about bytes that are none."""

    def read_bytes(data: bytes) -> object:
        try:
            text = data.decode()
        except UnicodeDecodeError:
            return None
        return read(text)

    return read_bytes


def with_endless_numbers(seeds: list[bytes]) -> list[bytes]:
    """Each seed with one of its numbers after the other made longer than Python reads them."""
    return [
        seed[: number.start()] + ENDLESS_NUMBER + seed[number.end() :]
        for seed in seeds
        for number in re.finditer(rb"[0-9]+", seed)
    ]
