"""Words that turn a wish round, bound it, or add another one: no goal has them. English, and German
where a recogniser or a keyboard may give it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from enum import Enum


class Turn(Enum):
    """What such a word does to a wish, and what can be done instead."""

    NEGATION = "a goal says what shall be, not what shall not: `nondum halt` ends what is pursued"
    CONDITION = "a goal has no condition and no end: ask for it when it is wanted, halt it after"
    ANOTHER = "ask for one thing after the other"


_WORDS = {
    Turn.NEGATION: (
        *(
            "not",
            "no",
            "never",
            "cannot",
            "without",
            "nor",
            "neither",
            "none",
            "nothing",
            "stop",
            "quit",
            "cancel",
            "except",
        ),
        *("instead", "nicht", "kein", "keine", "keinen", "nie", "ohne"),
    ),
    Turn.CONDITION: (
        *("until", "till", "unless", "if", "when", "whenever", "while", "before", "after"),
        *("once", "only", "bis", "wenn", "falls", "sobald"),
    ),
    Turn.ANOTHER: ("and", "or", "then", "but", "afterwards", "und", "oder", "dann", "aber"),
}
_SHORT_NOT = re.compile(
    r"\w+n't|(?:do|does|did|ca|wo|is|are|was|were|has|have|must|should|could|would)nt"
)
_TURNS = {word: turn for turn, words in _WORDS.items() for word in words}


def turning_words(words: Iterable[str]) -> dict[str, Turn]:
    """Those among some words.

    >>> [(word, turn.name) for word, turn in turning_words(("go", "until", "noon")).items()]
    [('until', 'CONDITION')]
    """
    found = ((word, _turn(word)) for word in words)
    return {word: turn for word, turn in found if turn is not None}


def _turn(word: str) -> Turn | None:
    return Turn.NEGATION if _SHORT_NOT.fullmatch(word) else _TURNS.get(word)
