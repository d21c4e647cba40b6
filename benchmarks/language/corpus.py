"""The sentences of the benchmark, what they mean, and which of them are kept from tuning."""

from __future__ import annotations

import hashlib
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

from nondum.sdk.frozen import frozen

FILE = Path(__file__).with_name("sentences.toml")
_MEANING = re.compile(r"none|halt|-?[A-Z](\|-?[A-Z])*|[A-Z]\?|[A-Z]([+>][A-Z])+")


@frozen
class KnownGoal:
    """A goal of the shipped payloads that a sentence may mean."""

    pddl: str
    kind: str


@frozen
class Sentence:
    """What a person says."""

    text: str
    group: str
    """Why it is there: `paraphrases`, `near-misses` …"""
    meaning: str
    """By the letters of the goals; see the head of the file."""

    @property
    def is_kept(self) -> bool:
        """Whether it is kept from tuning, and judges."""
        return hashlib.sha256(self.text.encode()).hexdigest()[0] in "89abcdef"

    @property
    def goals(self) -> frozenset[str]:
        """The letters of all goals that it speaks of."""
        return frozenset(re.findall("[A-Z]", self.meaning))


def goals() -> Mapping[str, KnownGoal]:
    """Letter → goal."""
    return {letter: KnownGoal(**said) for letter, said in _read()["goals"].items()}


def sentences() -> tuple[Sentence, ...]:
    """All of them, in the file's order. Raises `ValueError` for a meaning that cannot be read."""
    return tuple(_sentences())


def _sentences() -> Iterator[Sentence]:
    for group, table in _read().items():
        if group == "goals":
            continue
        for meaning, texts in table.items():
            if not _MEANING.fullmatch(meaning):
                raise ValueError(f"[{group}] {meaning!r} is no meaning")
            yield from (Sentence(text, group, meaning) for text in texts)


def _read() -> Mapping[str, Mapping[str, dict[str, str]]]:
    return tomllib.loads(FILE.read_text(encoding="utf-8"))
