"""Words around a wish that change nothing of it: "could you …, please". English."""

from __future__ import annotations

from collections.abc import Sequence

from nondum.planning.words.pattern import words_of

_BEFORE = (
    *("please", "robot", "hey", "hello", "ok", "okay", "so", "well", "now", "just", "kindly"),
    *("could you", "can you", "would you", "will you", "you should", "you can", "you may"),
    *("i want you to", "i'd like you to", "i would like you to", "i need you to", "let's go"),
    *("go and", "do you know", "i need to know", "i want to know"),
)
_BEHIND = (
    *("please", "robot", "now", "right now", "at once", "immediately", "thanks", "thank you"),
    *("for me", "for us", "at the moment", "will you", "would you", "can you", "could you"),
    *("if you please", "right away"),
)


def _longest_first(said: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    return tuple(sorted(map(words_of, said), key=len, reverse=True))


_LEADING, _TRAILING = _longest_first(_BEFORE), _longest_first(_BEHIND)


def without_courtesies(words: Sequence[str]) -> tuple[str, ...]:
    """What a sentence asks for, without what only makes it polite. Never empties it.

    >>> without_courtesies(words_of("Robot, could you please follow me now?"))
    ('follow', 'me')
    """
    left = tuple(words)
    while True:
        shorter = _cut(left)
        if shorter == left:
            return left
        left = shorter


def _cut(words: tuple[str, ...]) -> tuple[str, ...]:
    for said in _LEADING:
        if len(said) < len(words) and words[: len(said)] == said:
            return words[len(said) :]
    for said in _TRAILING:
        if len(said) < len(words) and words[-len(said) :] == said:
            return words[: -len(said)]
    return words
