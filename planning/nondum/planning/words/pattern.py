"""Patterns of words with typed slots: `point at {t:target}`, `follow me [through {words:text}]`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeAlias

from nondum.sdk.frozen import frozen

FREE_WORDS = "text"
"""The slot type that takes any words, and binds nothing."""

ARTICLES = frozenset({"the", "a", "an"})
_PART = re.compile(r"\s*(?:\{\s*([\w-]+)\s*(?::\s*([\w-]+)\s*)?\}|([\[\]])|([^\s\[\]{}]+))")
_SEPARATORS = re.compile(r"[^\w'-]+")
_APOSTROPHES = dict.fromkeys(map(ord, "\u2019\u2018\u02bc\u00b4"), "'")
"""As phones and word processors write them."""


class PatternInvalid(ValueError):
    """A pattern that cannot be read; the message says why."""


@frozen
class Word:
    """A word that must be said."""

    text: str


@frozen
class Slot:
    """A place for words that name something."""

    name: str
    types: tuple[str, ...]
    """Empty where the pattern gave a name only."""

    @property
    def is_free(self) -> bool:
        """Whether it takes any words."""
        return self.types == (FREE_WORDS,)


@frozen
class Optional:
    """A part that may be left out."""

    parts: tuple[Part, ...]


Part: TypeAlias = Word | Slot | Optional
Said: TypeAlias = Mapping[str, tuple[str, ...]]
"""Slot name → the words said there."""


def words_of(text: str) -> tuple[str, ...]:
    """The words of a sentence or label, without case and punctuation.

    >>> words_of("Point at the Radiation-source, now!")
    ('point', 'at', 'the', 'radiation-source', 'now')
    """
    plain = text.casefold().translate(_APOSTROPHES)
    return tuple(word for word in _SEPARATORS.split(plain) if word)


def name_words(words: Sequence[str]) -> tuple[str, ...]:
    """Words as a name is looked up: hyphens open, no article before it.

    >>> name_words(("the", "radiation-source"))
    ('radiation', 'source')
    """
    opened = tuple(part for word in words for part in word.split("-") if part)
    return opened[1:] if len(opened) > 1 and opened[0] in ARTICLES else opened


def as_said(text: str) -> str:
    """A pattern as people would say it, without what may be left out.

    >>> as_said("[please] point at {t:target}"), as_said("point at the source")
    ('point at something', 'point at the source')
    """
    try:
        parts = parse_pattern(text)
    except PatternInvalid:
        return text
    return " ".join(_spoken(parts, lambda slot: "" if slot.is_free else "something"))


def with_blanks(text: str) -> str:
    """A pattern with its slots as blanks to be filled in, without what may be left out.

    >>> with_blanks("[please] point at {t:target}"), with_blanks("write {words:text}")
    ('point at <target>', 'write <words>')
    """
    try:
        parts = parse_pattern(text)
    except PatternInvalid:
        return text
    return " ".join(_spoken(parts, _blank))


def with_slots(parts: Sequence[Part]) -> str:
    """A pattern's words and the names of its slots, without what may be left out.

    >>> with_slots(parse_pattern("[please] point at {t:target}"))
    'point at {t}'
    """
    return " ".join(_spoken(parts, lambda slot: f"{{{slot.name}}}"))


def _blank(slot: Slot) -> str:
    return f"<{slot.name if slot.is_free or not slot.types else ' or '.join(slot.types)}>"


def _spoken(parts: Sequence[Part], filled: Callable[[Slot], str]) -> Iterator[str]:
    """What must be said, with what a slot is `filled` with."""
    for part in parts:
        match part:
            case Word(text):
                yield text
            case Slot() as slot if said := filled(slot):
                yield said


def parse_pattern(text: str) -> tuple[Part, ...]:
    """Read a pattern. Raises `PatternInvalid`."""
    stack: list[list[Part]] = [[]]
    position = 0
    while position < len(text.rstrip()):
        match = _PART.match(text, position)
        if match is None:
            raise PatternInvalid(f"{text[position:].strip()!r} is not understood")
        position = match.end()
        slot, type_, bracket, word = match.groups()
        if slot:
            stack[-1].append(Slot(slot, (type_,) if type_ else ()))
        elif word:
            stack[-1] += map(Word, words_of(word))
        elif bracket == "[":
            stack.append([])
        elif len(stack) > 1:
            optional = tuple(stack.pop())
            stack[-1].append(Optional(optional))
        else:
            raise PatternInvalid("']' closes nothing")
    if len(stack) > 1:
        raise PatternInvalid("'[' is not closed")
    if not any(isinstance(part, Word) for part in stack[0]):
        raise PatternInvalid("there is no word in it that must be said")
    return tuple(stack[0])


def slots_of(parts: Sequence[Part]) -> Iterator[Slot]:
    """All slots, in order, those in optional parts too."""
    for part in parts:
        if isinstance(part, Slot):
            yield part
        elif isinstance(part, Optional):
            yield from slots_of(part.parts)


def matches(
    parts: Sequence[Part],
    words: Sequence[str],
    is_name: Callable[[Slot, tuple[str, ...]], bool],
) -> Iterator[Said]:
    """Every way to read `words` as the pattern; `is_name` says what a slot accepts."""
    if not parts:
        if not words:
            yield {}
        return
    part, others = parts[0], parts[1:]
    match part:
        case Word():
            if words and words[0] == part.text:
                yield from matches(others, words[1:], is_name)
        case Optional():
            yield from matches((*part.parts, *others), words, is_name)
            yield from matches(others, words, is_name)
        case Slot():
            for length in range(1, len(words) + 1):
                said = tuple(words[:length])
                if is_name(part, said):
                    for rest in matches(others, words[length:], is_name):
                        yield {part.name: said, **rest}
