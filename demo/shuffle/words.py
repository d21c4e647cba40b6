"""Random words from a seed: they can be pronounced, and mean nothing."""

from __future__ import annotations

import keyword
from collections.abc import Iterable
from random import Random

_CONSONANTS = "bdfghjklmnprstvwz"
_VOWELS = "aeiou"
_SYLLABLES = 4  # of three, some are words: rename, module


class Words:
    """A source of words that differ from each other and from those that are taken."""

    def __init__(self, seed: int, taken: Iterable[str] = ()) -> None:
        self.random = Random(f"words {seed}")
        self._taken = {*taken, *keyword.kwlist, *keyword.softkwlist}

    def word(self) -> str:
        """Four syllables of small letters, never given before."""
        while True:
            made = "".join(
                self.random.choice(_CONSONANTS) + self.random.choice(_VOWELS)
                for _ in range(_SYLLABLES)
            )
            if made not in self._taken:
                self._taken.add(made)
                return made

    def name(self) -> str:
        """Two words with a hyphen, as distributions and components are called."""
        return f"{self.word()}-{self.word()}"

    def shuffled(self, items: Iterable[str]) -> tuple[str, ...]:
        """The items in another order."""
        mixed = sorted(items)
        self.random.shuffle(mixed)
        return tuple(mixed)
