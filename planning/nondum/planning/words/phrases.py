"""Goals in a person's words: phrases of some plugins, labels of others, matched exactly."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from difflib import get_close_matches
from itertools import islice

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.goal import Goal
from nondum.planning.merge.scope import SELF
from nondum.planning.words.pattern import Part, Said, Slot, Word, matches, name_words, words_of
from nondum.planning.words.phrase import KnownPhrase, known_phrases
from nondum.planning.words.turning import turning_words
from nondum.sdk.errors import GoalRefused, Problem
from nondum.sdk.frozen import frozen

MAX_WORDS = 40
"""A longer sentence is not looked at."""
MAX_OFFERS = 200
"""Sentences of one phrase that are listed, however many names there are."""

_Names = Mapping[tuple[str, ...], frozenset[str]]


@frozen
class Reading:
    """What a sentence means by one phrase."""

    phrase: KnownPhrase
    bound: Mapping[str, str]
    """Slot → the object that its words name."""
    goal: Goal

    @property
    def meaning(self) -> tuple[object, ...]:
        """Equal for readings that ask for the same."""
        return self.goal.expr, self.goal.kind

    def __str__(self) -> str:
        return f'{self.goal}, by "{self.phrase.pattern}" of {self.phrase.plugin}'


@frozen
class Phrasebook:
    """What people can say now. Make it with `phrasebook`, again after each merge."""

    merged: Merged
    phrases: tuple[KnownPhrase, ...]
    names: _Names
    """Words → the objects that they may mean."""
    labels: Mapping[str, str]
    """Object → the words to say it with."""
    namers: Mapping[str, str]
    """Object → the component whose label `labels` has for it."""
    problems: tuple[Problem, ...] = ()
    """Phrases that cannot be used, and why."""

    def goal(self, sentence: str) -> Goal:
        """The goal that a sentence asks for. Raises `GoalRefused` as `reading` does."""
        return self.reading(sentence).goal

    def reading(self, sentence: str) -> Reading:
        """What a sentence means.

        Raises `GoalRefused`: PHRASE_UNKNOWN, PHRASE_WORDS_UNKNOWN, PHRASE_AMBIGUOUS.
        """
        words = words_of(sentence)
        if len(words) > MAX_WORDS:
            raise GoalRefused(Problem("PHRASE_UNKNOWN", f"more than {MAX_WORDS} words"))
        found = self._readings(sentence, words)
        if len(found) > 1:
            raise GoalRefused(self._ambiguous(sentence, found))
        if not found:
            raise GoalRefused(self._unknown(sentence, words))
        return found[0]

    def offers(self) -> tuple[str, ...]:
        """Sentences that can be said now: each phrase with every name that fits its slots."""
        return tuple(sorted({offer.goal.text for offer in self.offered()}))

    def offered(self) -> Iterator[Reading]:
        """What the sentences that can be said now mean; `goal.text` is the sentence.

        A free slot stands in it as `<name>`. Up to `MAX_OFFERS` of each phrase.
        """
        for phrase in self.phrases:
            for sentence, bound in islice(self._sentences(phrase.parts), MAX_OFFERS):
                yield self.reading_of(phrase, bound, sentence)

    def things_for(self, slot: Slot) -> tuple[str, ...]:
        """The objects that can be named in a slot."""
        return tuple(sorted(name for name in self.labels if self._fits(name, slot)))

    def names_for(self, slot: Slot) -> list[str]:
        """All words for the objects that can be named in a slot; none for a free one."""
        fitting = frozenset(() if slot.is_free else self.things_for(slot))
        return sorted(" ".join(words) for words, things in self.names.items() if things & fitting)

    def _readings(self, sentence: str, words: tuple[str, ...]) -> list[Reading]:
        """Every different thing that a sentence may ask for."""
        found: dict[tuple[object, ...], Reading] = {}
        for phrase in self.phrases:
            for said in matches(phrase.parts, words, self._is_name):
                for bound in self._bindings(phrase, said):
                    reading = self.reading_of(phrase, bound, sentence)
                    found.setdefault(reading.meaning, reading)
        return list(found.values())

    def reading_of(self, phrase: KnownPhrase, bound: Mapping[str, str], sentence: str) -> Reading:
        """What a phrase means with objects in its slots."""
        names = {SELF: self.merged.self_host, **{f"?{slot}": name for slot, name in bound.items()}}
        return Reading(phrase, bound, Goal(phrase.condition.bound(names), phrase.kind, sentence))

    def _bindings(self, phrase: KnownPhrase, said: Said) -> Iterator[dict[str, str]]:
        """Every choice of objects for the words said in the slots."""
        bindings: list[dict[str, str]] = [{}]
        for slot in phrase.binding_slots():
            meant = sorted(self._meant(slot, said[slot.name])) if slot.name in said else []
            bindings = [{**b, slot.name: name} for b in bindings for name in meant]
        yield from bindings

    def _meant(self, slot: Slot, words: tuple[str, ...]) -> frozenset[str]:
        objects = self.names.get(name_words(words), frozenset())
        return frozenset(name for name in objects if self._fits(name, slot))

    def _fits(self, name: str, slot: Slot) -> bool:
        types = self.merged.objects[name].types
        return self.merged.domain.types.is_one_of(types, slot.types)

    def _is_name(self, slot: Slot, words: tuple[str, ...]) -> bool:
        """Words of a free slot change nothing, so none may be there that turns what is meant."""
        return not turning_words(words) if slot.is_free else bool(self._meant(slot, words))

    def _sentences(self, parts: tuple[Part, ...]) -> Iterator[tuple[str, dict[str, str]]]:
        """Sentences of a pattern, the shortest way, and what their slots stand for."""
        if not parts:
            yield "", {}
            return
        heads: list[tuple[str, dict[str, str]]] = [("", {})]
        match parts[0]:
            case Word(text):
                heads = [(text, {})]
            case Slot(is_free=True, name=name):
                heads = [(f"<{name}>", {})]
            case Slot(name=name) as slot:
                heads = [(self.labels[thing], {name: thing}) for thing in self.things_for(slot)]
        for head, bound in heads:
            for tail, others in self._sentences(parts[1:]):
                yield f"{head} {tail}".strip(), {**bound, **others}

    def _ambiguous(self, sentence: str, readings: Iterable[Reading]) -> Problem:
        meanings = " or ".join(map(str, readings))
        spelled = [_spelled(reading) for reading in readings]
        clear = [text for text in spelled if len(self._readings(text, words_of(text))) == 1]
        ways = _listed("say", dict.fromkeys(clear)) if clear else "say which one by its name"
        fix = f"{ways}; or give the goal in PDDL"
        return Problem("PHRASE_AMBIGUOUS", f"{sentence!r} may mean {meanings}", fix=fix)

    def _unknown(self, sentence: str, words: tuple[str, ...]) -> Problem:
        for phrase in self.phrases:
            for said in matches(phrase.parts, words, lambda _slot, _words: True):
                for slot in phrase.binding_slots():
                    if slot.name in said and not self._meant(slot, said[slot.name]):
                        return _with_hint(words, self._unknown_words(slot, said[slot.name]))
        if not self.phrases:
            return Problem(
                "PHRASE_UNKNOWN",
                f"nothing here understands {sentence!r}: nothing is plugged in that knows words",
                fix="plug in what can do it, or give the goal in PDDL",
            )
        offers = self.offers()
        near = get_close_matches(" ".join(words), offers, n=3, cutoff=0.5)
        fix = _listed("say", near) if near else _listed("you can say", offers[:3])
        message = f"nothing here understands {sentence!r}"
        return _with_hint(words, Problem("PHRASE_UNKNOWN", message, fix=fix))

    def _unknown_words(self, slot: Slot, words: tuple[str, ...]) -> Problem:
        known = sorted(label for name, label in self.labels.items() if self._fits(name, slot))
        near = get_close_matches(" ".join(words), known, n=3, cutoff=0.5) or known[:5]
        message = f"no {' or '.join(slot.types)} is called {' '.join(words)!r}"
        return Problem("PHRASE_WORDS_UNKNOWN", message, fix=_listed("known", near))


def phrasebook(contributions: Iterable[Contribution], merged: Merged) -> Phrasebook:
    """Collect what the admitted contributions let people say."""
    present = sorted(
        (c for c in contributions if c.component not in merged.quarantined),
        key=lambda contribution: (contribution.host, contribution.component),
    )
    phrases, problems = known_phrases(present, merged)
    labels: dict[str, str] = {}
    namers: dict[str, str] = {}
    names: dict[tuple[str, ...], frozenset[str]] = {}
    for name, words, namer in _said_names(present, merged):
        if name in merged.objects:
            if name not in labels and namer:
                namers[name] = namer
            labels.setdefault(name, " ".join(words))
            key = name_words(words)
            names[key] = names.get(key, frozenset()) | {name}
    return Phrasebook(merged, phrases, names, labels, namers, problems)


def _said_names(
    contributions: Iterable[Contribution], merged: Merged
) -> Iterator[tuple[str, tuple[str, ...], str]]:
    """Objects with words for them, and whose words: labels, then the names of shared objects."""
    for contribution in contributions:
        own = {SELF: contribution.host, **contribution.local_names()}
        for label in contribution.labels:
            thing = own.get(label.object, label.object)
            yield thing, words_of(label.words), contribution.component
    for name, found in merged.objects.items():
        if not found.component:
            yield name, name_words((name,)), ""


def _with_hint(words: Iterable[str], problem: Problem) -> Problem:
    """The problem; where a word turns what is meant, with what can be done instead."""
    for word, turn in turning_words(words).items():
        return replace(problem, fix=f"{word!r} is in it: {turn.value}; {problem.fix}")
    return problem


def _spelled(reading: Reading) -> str:
    """The sentence of a reading with each thing called by its own name."""
    said: list[str] = []
    for part in reading.phrase.parts:
        match part:
            case Word(text):
                said.append(text)
            case Slot(is_free=True, name=name):
                said.append(f"<{name}>")
            case Slot(name=name):
                said += name_words((reading.bound[name],))
    return " ".join(said)


def _listed(verb: str, sentences: Iterable[str]) -> str:
    listed = ", ".join(f'"{sentence}"' for sentence in sentences)
    return f"{verb}: {listed}" if listed else ""
