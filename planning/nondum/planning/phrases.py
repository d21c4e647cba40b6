"""Goals in a person's words: phrases of some plugins, labels of others, matched exactly."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches

from nondum.planning.contribution import Contribution
from nondum.planning.domain import Merged
from nondum.planning.goal import Goal, goal_text
from nondum.planning.merge import quarantine_key
from nondum.planning.pattern import (
    Optional,
    Part,
    Said,
    Slot,
    Word,
    matches,
    name_words,
    words_of,
)
from nondum.planning.phrase import KnownPhrase, known_phrases
from nondum.planning.scope import SELF
from nondum.sdk.errors import GoalRefused, Problem

MAX_WORDS = 40
"""A longer sentence is not looked at."""

_Names = Mapping[tuple[str, ...], frozenset[str]]


@dataclass(frozen=True, slots=True)
class Phrasebook:
    """What people can say now. Make it with `phrasebook`, anew after each merge."""

    merged: Merged
    phrases: tuple[KnownPhrase, ...]
    names: _Names
    """Words → the objects that they may mean."""
    labels: Mapping[str, str]
    """Object → the words to say it with."""
    problems: tuple[Problem, ...] = ()
    """Phrases that cannot be used, and why."""

    def goal(self, sentence: str) -> Goal:
        """The goal that a sentence asks for.

        Raises `GoalRefused`: PHRASE_UNKNOWN, PHRASE_WORDS_UNKNOWN, PHRASE_AMBIGUOUS.
        """
        words = words_of(sentence)
        if len(words) > MAX_WORDS:
            raise GoalRefused(Problem("PHRASE_UNKNOWN", f"more than {MAX_WORDS} words"))
        found: list[Goal] = []
        for goal in self._goals(sentence, words):
            if all((goal.expr, goal.kind) != (other.expr, other.kind) for other in found):
                found.append(goal)
        if len(found) > 1:
            raise GoalRefused(_ambiguous(sentence, found))
        if not found:
            raise GoalRefused(self._unknown(sentence, words))
        return found[0]

    def offers(self) -> tuple[str, ...]:
        """Sentences that can be said now: each phrase with every name that fits its slots."""
        return tuple(
            sorted({text for phrase in self.phrases for text in self._sentences(phrase.parts)})
        )

    def _goals(self, sentence: str, words: tuple[str, ...]) -> Iterator[Goal]:
        for phrase in self.phrases:
            for said in matches(phrase.parts, words, self._is_name):
                for bound in self._bindings(phrase, said):
                    names = {SELF: self.merged.self_host, **bound}
                    yield Goal(phrase.condition.bound(names), phrase.kind, sentence)

    def _bindings(self, phrase: KnownPhrase, said: Said) -> Iterator[dict[str, str]]:
        """Every choice of objects for the words said in the slots."""
        bindings: list[dict[str, str]] = [{}]
        for slot in phrase.binding_slots():
            meant = sorted(self._meant(slot, said[slot.name])) if slot.name in said else []
            bindings = [{**b, f"?{slot.name}": name} for b in bindings for name in meant]
        yield from bindings

    def _meant(self, slot: Slot, words: tuple[str, ...]) -> frozenset[str]:
        objects = self.names.get(name_words(words), frozenset())
        return frozenset(name for name in objects if self._fits(name, slot))

    def _fits(self, name: str, slot: Slot) -> bool:
        types = self.merged.objects[name].types
        return self.merged.domain.types.is_one_of(types, slot.types)

    def _is_name(self, slot: Slot, words: tuple[str, ...]) -> bool:
        return slot.is_free or bool(self._meant(slot, words))

    def _sentences(self, parts: tuple[Part, ...]) -> Iterator[str]:
        if not parts:
            yield ""
            return
        match parts[0]:
            case Word(text):
                heads = [text]
            case Slot(is_free=True, name=name):
                heads = [f"<{name}>"]
            case Slot() as slot:
                heads = [label for name, label in self.labels.items() if self._fits(name, slot)]
            case Optional():
                heads = [""]
        for head in heads:
            for tail in self._sentences(parts[1:]):
                yield f"{head} {tail}".strip()

    def _unknown(self, sentence: str, words: tuple[str, ...]) -> Problem:
        for phrase in self.phrases:
            for said in matches(phrase.parts, words, lambda _slot, _words: True):
                for slot in phrase.binding_slots():
                    if slot.name in said and not self._meant(slot, said[slot.name]):
                        return self._unknown_words(slot, said[slot.name])
        offers = self.offers()
        near = get_close_matches(" ".join(words), offers, n=3, cutoff=0.5)
        fix = _listed("say", near) if near else _listed("you can say", offers[:3])
        return Problem("PHRASE_UNKNOWN", f"nothing here understands {sentence!r}", fix=fix)

    def _unknown_words(self, slot: Slot, words: tuple[str, ...]) -> Problem:
        known = sorted(label for name, label in self.labels.items() if self._fits(name, slot))
        near = get_close_matches(" ".join(words), known, n=3, cutoff=0.5) or known[:5]
        message = f"no {' or '.join(slot.types)} is called {' '.join(words)!r}"
        return Problem("PHRASE_WORDS_UNKNOWN", message, fix=_listed("known", near))


def phrasebook(contributions: Iterable[Contribution], merged: Merged) -> Phrasebook:
    """Collect what the admitted contributions let people say."""
    present = sorted(
        (c for c in contributions if quarantine_key(c, merged.self_host) not in merged.quarantined),
        key=lambda contribution: (contribution.host, contribution.component),
    )
    phrases, problems = known_phrases(present, merged)
    labels: dict[str, str] = {}
    names: dict[tuple[str, ...], frozenset[str]] = {}
    for name, words in _said_names(present, merged):
        if name in merged.objects:
            labels.setdefault(name, " ".join(words))
            key = name_words(words)
            names[key] = names.get(key, frozenset()) | {name}
    return Phrasebook(merged, phrases, names, labels, problems)


def _said_names(
    contributions: Iterable[Contribution], merged: Merged
) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Objects with words for them: labels first, then the names of shared objects."""
    for contribution in contributions:
        own = {SELF: contribution.host, **contribution.local_names()}
        for label in contribution.labels:
            yield own.get(label.object, label.object), words_of(label.words)
    for name, found in merged.objects.items():
        if not found.component:
            yield name, name_words((name,))


def _ambiguous(sentence: str, goals: Iterable[Goal]) -> Problem:
    meanings = " or ".join(f"{goal.kind} {goal_text(goal.expr)}" for goal in goals)
    return Problem(
        "PHRASE_AMBIGUOUS", f"{sentence!r} may mean {meanings}", fix="say which one by its name"
    )


def _listed(verb: str, sentences: Iterable[str]) -> str:
    listed = ", ".join(f'"{sentence}"' for sentence in sentences)
    return f"{verb}: {listed}" if listed else ""
