"""What can be said now, for those that listen: they hear best what they expect.

Sentences are not listed one by one, as they are for people: a recogniser makes a grammar of
patterns and names.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import TypeAlias

from nondum.planning.words.asking import ASKED
from nondum.planning.words.pattern import Optional, Part, Slot, Word
from nondum.planning.words.phrase import KnownPhrase
from nondum.planning.words.phrases import Phrasebook
from nondum.planning.words.stop_words import STOP_PATTERNS, stop_patterns

SAYINGS_BYTES = 40_000
"""Most bytes of sayings: they fit into one packet to a worker, with a margin."""

ADDRESSEE = "addressee"
"""Slot for the name of the host that is spoken to."""

Sayings: TypeAlias = dict[str, object]


def sayings(book: Phrasebook, hosts: Sequence[str] = ()) -> Sayings:
    """`phrases`: patterns that can be said now; `names`: slot → words that may be said there;
    `stops`: those of the patterns that stop the robot.

    These come first, then what it is asked about itself. Slots are called by the
    types of what they name. A phrase without a name for one of its slots cannot be said. Each of
    the `hosts` can be addressed first, and stopped with its name behind the word, too. What does
    not fit into a packet is left out, names first.
    """
    names: dict[str, list[str]] = {}
    addressee = f"[{{{ADDRESSEE}}}] " if hosts else ""
    stops = list(stop_patterns(f"{{{ADDRESSEE}}}") if hosts else STOP_PATTERNS)
    phrases = dict.fromkeys((*stops, *(f"{addressee}{said}" for said in ASKED)))
    for phrase in book.phrases:
        slots = {slot: book.names_for(slot) for slot in phrase.binding_slots()}
        if all(slots.values()):
            names.update({_called(slot): words for slot, words in slots.items()})
            phrases[f"{addressee}{_pattern(phrase)}"] = None
    if hosts:
        names[ADDRESSEE] = sorted(host.replace("-", " ") for host in hosts)
    told = list(phrases)
    while told and _size(told, names) > SAYINGS_BYTES:
        if all(len(words) < 2 for words in names.values()):
            told = told[: len(told) // 2]
        names = {slot: words[: (len(words) + 1) // 2] for slot, words in names.items()}
    return {"phrases": told, "names": names if told else {}, "stops": stops if told else []}


def _pattern(phrase: KnownPhrase) -> str:
    return " ".join(_spelt(phrase.parts))


def _spelt(parts: Sequence[Part]) -> Iterator[str]:
    for part in parts:
        match part:
            case Word(text):
                yield text
            case Slot() as slot:
                yield f"{{{_called(slot)}}}"
            case Optional(inner):
                yield f"[{' '.join(_spelt(inner))}]"


def _called(slot: Slot) -> str:
    return "-or-".join(slot.types)


def _size(phrases: list[str], names: dict[str, list[str]]) -> int:
    return len(json.dumps([phrases, names]))
