"""Sentences that are nearly a phrase: courtesies around it, a slip of the keys, words misheard.

What is found is asked back. A sentence is near another when few of its letters
differ, blanks left out, since who hears wrongly hears other words ("a purse on" for "a person").
Words that turn or bound a wish ("not", "until") are no slips, however few their letters are.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, product
from typing import TypeAlias

from nondum.planning.words.courtesies import without_courtesies
from nondum.planning.words.pattern import ARTICLES, Part, Slot, Word, words_of
from nondum.planning.words.phrase import KnownPhrase
from nondum.planning.words.phrases import MAX_OFFERS, MAX_WORDS, Phrasebook, Reading
from nondum.planning.words.turning import turning_words
from nondum.sdk.errors import GoalRefused
from nondum.sdk.frozen import frozen

_Sayable: TypeAlias = tuple[str, KnownPhrase, dict[str, str]]
FURTHEST = 0.2
"""Letters that may differ, of those of the phrase."""
APART = 0.1
"""A phrase that is no more than this further away than the nearest could be meant as well."""
MOST_LETTERS = 300
"""A longer sentence is not looked at."""
MOST_SENTENCES = 2000
"""Of those that can be said, the number that is compared: a second of work on a small board."""
_SHORTEST = 6
"""Letters: of what is shorter, too little is left."""
_OTHERS = frozenset({"he", "she", "him", "her", "them", "they", "we", "us", "it"})
"""Who or what else is meant, in few letters."""


_OPPOSITES = tuple(
    frozenset(pair.split())
    for pair in ("on off", "left right", "up down", "in out", "north south", "east west")
)
_PREFIX = re.compile("un|dis|de|in|im|non")
"""What turns a word into its opposite."""


@frozen
class Near:
    """A phrase that a sentence may be meant as."""

    words: str
    """How it is said."""
    reading: Reading
    distance: float
    """Letters that differ, of those of the phrase; 0: only courtesies do."""


def nearest(book: Phrasebook, sentence: str) -> tuple[Near, ...]:
    """The phrases that a sentence may be meant as, nearest first, one for each meaning.

    Several where it is not clear which; none where none is near. Takes from some milliseconds to a
    second: not for a loop.
    """
    every = words_of(sentence) if len(sentence) <= MOST_LETTERS else ()
    if not 0 < len(every) <= MAX_WORDS:
        return ()
    words = without_courtesies(every)
    if (said := _exact(book, " ".join(words))) is not None:
        return (said,)
    letters = _letters(words)
    if len(letters) < _SHORTEST:
        return ()
    found: dict[tuple[object, ...], Near] = {}
    for text, phrase, bound in islice(_sayable(book), MOST_SENTENCES):
        if (distance := _distance(words, letters, text)) is not None:
            one = Near(text, book.reading_of(phrase, bound, text), distance)
            before = found.get(one.reading.meaning)
            if before is None or distance < before.distance:
                found[one.reading.meaning] = one
    ordered = sorted(found.values(), key=lambda one: (one.distance, one.words))
    return tuple(one for one in ordered if one.distance <= ordered[0].distance + APART)


def _exact(book: Phrasebook, text: str) -> Near | None:
    try:
        reading = book.reading(text)
    except GoalRefused:
        return None
    return Near(text, reading, 0.0)


def _distance(words: tuple[str, ...], letters: str, text: str) -> float | None:
    """How far apart they are; None: too far, or a word turns what is meant."""
    meant = words_of(text)
    said, other = set(words) - set(meant), set(meant) - set(words)
    if turning_words(said | other) or _OTHERS & (said | other) or _is_another(said, other):
        return None
    wanted = _letters(meant)
    most = int(FURTHEST * len(wanted))
    differing = edits(letters, wanted, most)
    return None if differing > most else differing / len(wanted)


def _is_another(said: set[str], meant: set[str]) -> bool:
    """Whether words that differ are numbers, or opposites: these are other things, not slips."""
    if any(any(map(str.isdecimal, word)) for word in said | meant):
        return True
    if any(len(pair & said) == 1 and len(pair & meant) == 1 for pair in _OPPOSITES):
        return True
    return bool({_stem(word) for word in said} & {_stem(word) for word in meant})


def _stem(word: str) -> str:
    """A word without the prefix that makes it its opposite.

    >>> _stem("deactivate"), _stem("increase"), _stem("lock")
    ('activate', 'crease', 'lock')
    """
    found = _PREFIX.match(word)
    return word[found.end() :] if found else word


def _letters(words: Sequence[str]) -> str:
    return "".join(word for word in words if word not in ARTICLES)


def edits(one: str, other: str, most: int) -> int:
    """Letters to change, leave out, add or swap with the next, to make one of the other.

    More than `most` where there are more than that (Damerau-Levenshtein distance, its restricted
    form: Boytsov, "Indexing methods for approximate dictionary searching", 2011).

    >>> edits("fllowme", "followme", 2), edits("follwome", "followme", 2), edits("me", "us", 1)
    (1, 1, 2)
    """
    if abs(len(one) - len(other)) > most:
        return most + 1
    before: Sequence[int] = ()
    last = list(range(len(other) + 1))
    for i, letter in enumerate(one, start=1):
        row = [i]
        for j, wanted in enumerate(other, start=1):
            cost = min(last[j] + 1, row[j - 1] + 1, last[j - 1] + (letter != wanted))
            if i > 1 and j > 1 and letter == other[j - 2] and one[i - 2] == wanted:
                cost = min(cost, before[j - 2] + 1)
            row.append(cost)
        if min(row) > most:
            return most + 1
        before, last = last, row
    return last[-1]


def _sayable(book: Phrasebook) -> Iterator[_Sayable]:
    """Sentences with the names that there are; none with words of a free slot. Up to `MAX_OFFERS`
    of each phrase."""
    names = _names(book)
    for phrase in book.phrases:
        yield from islice(_sentences(book, phrase, names), MAX_OFFERS)


def _sentences(
    book: Phrasebook, phrase: KnownPhrase, names: Mapping[str, Sequence[str]]
) -> Iterator[_Sayable]:
    ways = [_ways(part, book, names) for part in phrase.parts]
    for chosen in product(*ways):
        text = " ".join(words for words, _ in chosen if words)
        bound = {slot: thing for _, bindings in chosen for slot, thing in bindings.items()}
        yield text, phrase, bound


def _ways(
    part: Part, book: Phrasebook, names: Mapping[str, Sequence[str]]
) -> list[tuple[str, dict[str, str]]]:
    """What can be said for a part, and what that binds."""
    match part:
        case Word(text):
            return [(text, {})]
        case Slot(is_free=True):
            return []
        case Slot(name=slot) as place:
            things = book.things_for(place)
            return [(words, {slot: thing}) for thing in things for words in names[thing]]
    return [("", {})]


def _names(book: Phrasebook) -> dict[str, list[str]]:
    """Object → all words for it."""
    said: dict[str, list[str]] = {thing: [] for thing in book.labels}
    for words, things in book.names.items():
        for thing in things:
            said[thing].append(" ".join(words))
    return said
