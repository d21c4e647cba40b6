"""What can be said now, as a grammar for the recogniser.

JSpeech Grammar Format, https://www.w3.org/TR/jsgf/, as PocketSphinx reads it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product

PHONES = (
    "AA", "AE", "AH", "AO", "AW", "AY", "B", "CH", "D", "DH", "EH", "ER", "EY", "F", "G", "HH",
    "IH", "IY", "JH", "K", "L", "M", "N", "NG", "OW", "OY", "P", "R", "S", "SH", "T", "TH", "UH",
    "UW", "V", "W", "Y", "Z", "ZH",
)  # fmt: skip
"""The recogniser's phones, without silence and noise."""
PHONE_WORDS = {f"phone.{phone.lower()}": phone for phone in PHONES}
"""Words of one phone: free words are heard as any phones, and understood in a second go."""

_PART = re.compile(r"\{([\w-]+)\}|([\[\]])|([^\s\[\]{}]+)")
_SLOT = re.compile(r"\{([\w-]+)\}")
_OPTIONAL_SLOT = re.compile(r"\[\s*\{([\w-]+)\}\s*\]")
_BREAKS = re.compile(r"[^\w'-]+")
_ARTICLES = ("the", "a", "an")
_HOST = "addressee"
"""The slot for a host's name. No article before it: the end of "stop" would be heard as one."""
_FREE = "free"


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """What can be said now, as a host tells it."""

    phrases: tuple[str, ...] = ()
    """Patterns with `[optional]` parts and `{slots}`."""
    names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Slot → the words that may be said there; a slot without names takes any."""
    stops: tuple[str, ...] = ()
    """The patterns that stop the robot."""

    @property
    def words(self) -> tuple[str, ...]:
        """Every word that may have to be heard, in the order of the alphabet."""
        texts = [word for phrase in self.phrases for _, _, word in _PART.findall(phrase)]
        texts += [name for names in self.names.values() for name in names]
        articles = _ARTICLES if any(self.names.values()) else ()
        return tuple(sorted({*articles, *(word for text in texts for word in words_of(text))}))


def sentences(pattern: str, names: Mapping[str, Iterable[str]]) -> Iterator[str]:
    """All that a pattern says, its optional parts not nested; slots without names say nothing.

    >>> sorted(sentences("[{who},] halt [now]", {"who": ["mule"]}))
    ['halt', 'halt now', 'mule halt', 'mule halt now']
    """
    pieces = [
        (*_readings(inner, names), *([""] if optional else []))
        for optional, inner in _pieces(pattern)
    ]
    for said in product(*pieces):
        yield " ".join(words_of(" ".join(said)))


def _pieces(pattern: str) -> Iterator[tuple[bool, str]]:
    """Whether it is optional, and each part of a pattern."""
    for number, text in enumerate(re.split(r"\[([^\[\]]*)\]", pattern)):
        if text.strip():
            yield number % 2 == 1, text


def _readings(text: str, names: Mapping[str, Iterable[str]]) -> Iterator[str]:
    parts = enumerate(_SLOT.split(text))  # text and slots in turn
    said = (tuple(names.get(part, ())) if number % 2 else (part,) for number, part in parts)
    yield from map("".join, product(*said))


def words_of(text: str) -> tuple[str, ...]:
    """The words of a text, as a host reads them.

    >>> words_of("The X-ray, 2!")
    ('the', 'x-ray', '2')
    """
    return tuple(word for word in _BREAKS.split(text.casefold()) if word.strip("'-"))


def jsgf(vocabulary: Vocabulary, sayable: frozenset[str]) -> str | None:
    """The grammar of all phrases whose words are `sayable`; None when nothing can be said.

    >>> book = Vocabulary(("[please] find {thing}",), {"thing": ("people", "people's")})
    >>> print(jsgf(book, frozenset({"please", "find", "people", "the"})))
    #JSGF V1.0;
    grammar said;
    <thing> = [the] (people);
    public <said> = [please] find <thing>;
    """
    rules = {
        slot: f"{'' if slot == _HOST else f'[{articles}] '}({' | '.join(alternatives)})"
        for slot, names in vocabulary.names.items()
        if (alternatives := list(_sayable(names, sayable)))
        if (articles := " | ".join(word for word in _ARTICLES if word in sayable))
    }
    said = [
        text
        for phrase in vocabulary.phrases
        if (text := _expansion(phrase, rules, vocabulary.names, sayable)) is not None
    ]
    if not said:
        return None
    if any(f"<{_FREE}>" in text for text in said):
        rules[_FREE] = f"({' | '.join(PHONE_WORDS)})+"
    named = [f"<{_rule(slot)}> = {text};" for slot, text in rules.items()]
    return "\n".join(
        ("#JSGF V1.0;", "grammar said;", *named, f"public <said> = {' | '.join(said)};")
    )


def _sayable(names: Iterable[str], sayable: frozenset[str]) -> Iterator[str]:
    for name in names:
        words = words_of(name)
        if words and sayable.issuperset(words):
            yield " ".join(words)


def _expansion(
    phrase: str, rules: Mapping[str, str], names: Mapping[str, object], sayable: frozenset[str]
) -> str | None:
    """A pattern in the grammar's form; None when it cannot be said. An optional slot whose names
    cannot be said is left out: a robot that cannot be named can be stopped."""
    parts: list[str] = []
    said = _OPTIONAL_SLOT.sub(lambda s: s[0] if s[1] in rules or s[1] not in names else "", phrase)
    for slot, bracket, word in _PART.findall(said):
        if slot and slot not in names:
            parts.append(f"<{_FREE}>")
        elif slot and slot in rules:
            parts.append(f"<{_rule(slot)}>")
        elif bracket:
            parts.append(bracket)
        elif word and sayable.issuperset(words_of(word)):
            parts += words_of(word)
        else:
            return None
    return " ".join(parts).replace("[ ", "[").replace(" ]", "]").replace("[]", "")


def _rule(slot: str) -> str:
    return re.sub(r"\W", "_", slot)
