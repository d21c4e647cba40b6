"""The world model: what the robot believes, where it has each belief from, and since when.

Every voice's last word on every fact is kept (see `provenance`), and what holds is worked out from
all of them: the order in which news of different moments arrive changes nothing, and who goes away
leaves exactly what never depended on them. On top lie the effects of established lasting
behaviours, for as long as they run. There is no clock: times are passed in, in seconds.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from nondum.planning.execute.provenance import (
    Evidence,
    Overlay,
    Provenance,
    Source,
    SourceKind,
    Voice,
    stands,
    weight,
)
from nondum.planning.ground.rivals import Weight, conflict, group_of, outdone
from nondum.planning.pddl.facts import is_twin, parts
from nondum.sdk.errors import Problem

MOST_DENIALS = 4096
"""Facts that one component may deny at once; of more, the oldest are forgotten."""


class WorldModel:
    """Everything that is believed. Satisfies `running.World`."""

    def __init__(self) -> None:
        self.revision = 0
        """Rises with every change."""
        self._provenance = Provenance()
        self._overlays: dict[str, Overlay] = {}
        self._seeded: dict[str, frozenset[str]] = {}
        self._denied: dict[str, dict[str, None]] = {}
        """Component → what it spoke against, oldest first."""
        self._observed: frozenset[str] = frozenset()
        self._functional: frozenset[str] = frozenset()
        self._objects: frozenset[str] | None = None
        self._parked: set[str] = set()
        self._words_taken = 0
        self._facts: frozenset[str] | None = None
        self._bare: frozenset[str] | None = None

    # Asking

    @property
    def facts(self) -> frozenset[str]:
        """Every fact that holds now; the same object until something changes."""
        if self._facts is None:
            self._facts = self._holding(self._overlays.values())
        return self._facts

    def facts_without(self, ended: Collection[str]) -> frozenset[str]:
        """The facts that would hold if these lasting behaviours had ended."""
        if not any(name in self._overlays for name in ended):
            return self.facts
        return self._holding(o for name, o in self._overlays.items() if name not in ended)

    @property
    def bare_facts(self) -> frozenset[str]:
        """The facts that would hold if every lasting behaviour had ended: what plans start from."""
        if self._bare is None:
            self._bare = self.facts_without(self._overlays)
        return self._bare

    def holds(self, fact: str) -> bool:
        """Whether a fact is believed."""
        return fact in self.facts

    def value(self, fact: str) -> Any:
        """The newest value of a valued fact, or None where it has none or does not hold."""
        if not self.holds(fact):
            return None
        valued = [source for source in self.sources(fact) if source.value is not None]
        return max(valued, key=lambda source: source.moment).value if valued else None

    def sources(self, fact: str) -> tuple[Source, ...]:
        """Who speaks for a fact, oldest first; lasting behaviours last."""
        return tuple(word for word in self._words(fact) if not word.is_against)

    def evidence(self, fact: str) -> Evidence:
        """All that speaks for a fact and against it."""
        words = self._words(fact)
        return Evidence(
            fact,
            self.holds(fact),
            tuple(word for word in words if not word.is_against),
            tuple(word for word in words if word.is_against),
            rival=self._believed_rival(fact),
            absent=tuple(self._absent(fact)),
        )

    def parked(self) -> tuple[str, ...]:
        """The facts that would hold if all the objects that they name were there."""
        return tuple(sorted(f for f in self._parked if self._is_upheld(f, ())))

    def conflicts(self) -> tuple[Problem, ...]:
        """Different observed values of one functional predicate: PDDL_FACT_CONFLICT."""
        observed: dict[str, dict[str, str]] = {}
        for fact in self._functional_facts():
            for source in self._prevailing(fact, ()) if fact not in self._parked else ():
                if source.kind is SourceKind.OBSERVATION:
                    observed.setdefault(group_of(fact), {})[source.who] = fact
        return tuple(
            conflict(says, next((f for f in says.values() if self.holds(f)), ""))
            for _, says in sorted(observed.items())
            if len(set(says.values())) > 1
        )

    # What the host knows

    def frame(
        self,
        *,
        objects: frozenset[str],
        observed: frozenset[str],
        functional: frozenset[str] = frozenset(),
    ) -> None:
        """Say which objects there are, and which predicates are observed or functional.

        Facts about other objects are parked until the object appears. The effects of behaviours on
        observed predicates are not assumed but waited for. A functional predicate has at most one
        last argument for each of the others.
        """
        if (objects, observed, functional) == (self._objects, self._observed, self._functional):
            return
        self._objects, self._observed, self._functional = objects, observed, functional
        self._parked = {fact for fact in self._provenance if self._absent(fact)}
        for fact in self._functional_facts():
            self._leave_newest(fact)
        self._changed()

    def set_host_facts(self, host: str, facts: Mapping[str, str], at_s: float) -> None:
        """Replace all that the host itself asserts: fact → why, in words."""
        voice = (SourceKind.HOST, host)
        for fact in self._provenance:
            if fact not in facts:
                self._drop(fact, voice)
        for fact, said in facts.items():
            if voice not in self._provenance.of(fact):
                self._take(fact, Source(SourceKind.HOST, host, said, at_s))

    def seed(self, component: str, facts: Iterable[str], at_s: float) -> None:
        """Apply a component's problem fragment; again only for facts that it did not have."""
        facts = frozenset(facts)
        for fact in sorted(facts - self._seeded.get(component, frozenset())):
            said = f"the fragment of {component} says so"
            self._take(fact, Source(SourceKind.FRAGMENT, component, said, at_s))
        self._seeded[component] = facts

    # What components say

    def know(self, fact: str, component: str, at_s: float, *, value: Any = None) -> None:
        """A component says that a fact holds, perhaps with a value."""
        said = f"{component} says so"
        self._take(fact, Source(SourceKind.OBSERVATION, component, said, at_s, value))

    def forget(self, fact: str, component: str, at_s: float) -> None:
        """A component says that a fact does not hold (any more).

        What others observe and what the host knows stays; what was only assumed gives way.
        """
        said = f"{component} says that it does not hold"
        source = Source(SourceKind.OBSERVATION, component, said, at_s, is_against=True)
        self._take(fact, source)
        denied = self._denied.setdefault(component, {})
        denied.pop(fact, None)
        denied[fact] = None
        if len(denied) > MOST_DENIALS:
            oldest = next(iter(denied))
            del denied[oldest]
            self.recant(oldest, component)

    def recant(self, fact: str, component: str) -> None:
        """A component takes back what it said against a fact, without saying that it holds."""
        voice = (SourceKind.OBSERVATION, component)
        word = self._provenance.of(fact).get(voice)
        if word and word.is_against:
            self._drop(fact, voice)

    def silence(self, component: str) -> None:
        """A component can say nothing any more: what it observes and what it runs is unknown.

        Its word against a fact stays: nothing comes to be believed because an observer died.
        """
        voice = (SourceKind.OBSERVATION, component)
        for fact in self._provenance:
            word = self._provenance.of(fact).get(voice)
            if word and not word.is_against:
                self._drop(fact, voice)
        for name in [n for n, o in self._overlays.items() if o.source.who == component]:
            self.end(name)

    # What behaviours do

    def establish(
        self, name: str, component: str, *, add: Iterable[str], delete: Iterable[str], at_s: float
    ) -> None:
        """The effects of a lasting behaviour hold from now until `end`."""
        added = _positive(add)
        said = f"{name} is established"
        source = self._numbered(Source(SourceKind.LASTING, component, said, at_s, action=name))
        self._overlays[name] = Overlay(added, _positive(delete) - added, source)
        self._changed()

    def end(self, name: str) -> None:
        """A lasting behaviour has ended, however it ended: its effects are undone."""
        if self._overlays.pop(name, None):
            self._changed()

    def succeed(
        self, name: str, component: str, *, add: Iterable[str], delete: Iterable[str], at_s: float
    ) -> None:
        """A finishing behaviour succeeded: its effects are believed unless they are observed."""
        added = _positive(add)
        said = f"{name} succeeded"
        source = Source(SourceKind.EFFECT, component, said, at_s, action=name)
        ended = replace(source, said=f"{said} and ended it", is_against=True)
        words = {**dict.fromkeys(_positive(delete), ended), **dict.fromkeys(added, source)}
        for fact, word in words.items():
            if parts(fact)[0] not in self._observed:
                self._take(fact, word)

    def withdraw_effects(self, facts: Iterable[str]) -> None:
        """Forget that finishing behaviours made facts true; who else says so is believed."""
        for fact in facts:
            for voice, word in tuple(self._provenance.of(fact).items()):
                if word.kind is SourceKind.EFFECT and not word.is_against:
                    self._drop(fact, voice)

    # What goes away

    def remove_component(self, component: str, objects: Collection[str]) -> None:
        """Retract all that a component says and runs, and all about its objects."""
        for fact in self._provenance:
            is_about = not set(parts(fact)[1]).isdisjoint(objects)
            for voice in [v for v in self._provenance.of(fact) if is_about or v[1] == component]:
                self._drop(fact, voice)
        self._overlays = {n: o for n, o in self._overlays.items() if o.source.who != component}
        self._seeded.pop(component, None)
        self._denied.pop(component, None)
        self._changed()

    # Keeping words

    def _take(self, fact: str, source: Source) -> None:
        is_new_word = (source.kind, source.who) not in self._provenance.of(fact)
        is_plain = fact in self._provenance and fact not in self._provenance.contested
        self._provenance.take(fact, self._numbered(source))
        if is_new_word and self._absent(fact):
            self._parked.add(fact)
        if parts(fact)[0] in self._functional:
            self._leave_newest(fact)
            is_plain = False  # a rival, perhaps of a running behaviour, may give way to it
        overlays = self._overlays.values()
        if source.is_against or not is_plain or any(fact in o.delete for o in overlays):
            self._changed()  # else no other fact is true than before

    def _leave_newest(self, fact: str) -> None:
        """A voice that gives a functional predicate another value takes its earlier one back."""
        for voice, word in tuple(self._provenance.of(fact).items()):
            if word.is_against or word.kind is SourceKind.FRAGMENT:
                continue
            for rival in tuple(self._provenance.rivals(fact)):
                other = self._provenance.of(rival).get(voice)
                if other and not other.is_against:
                    self._drop(rival if other.moment < word.moment else fact, voice)

    def _drop(self, fact: str, voice: Voice) -> None:
        if self._provenance.drop(fact, voice):
            if fact not in self._provenance:
                self._parked.discard(fact)
            self._changed()

    def _numbered(self, source: Source) -> Source:
        self._words_taken += 1
        return replace(source, number=self._words_taken)

    def _changed(self) -> None:
        self.revision += 1
        self._facts = self._bare = None

    # Working out what holds

    def _holding(self, overlays: Iterable[Overlay]) -> frozenset[str]:
        overlays = tuple(overlays)
        touched = frozenset[str]().union(*(o.add | o.delete for o in overlays))
        facts = self._provenance.uncontested() - touched
        doubtful = touched.union(self._provenance.contested)
        facts |= {fact for fact in doubtful if self._is_upheld(fact, overlays)}
        facts -= self._parked
        facts -= {fact for fact in touched if self._absent(fact)}
        if self._functional:
            facts -= outdone(facts, self._functional, lambda f: self._weight(f, overlays))
        return frozenset(facts)

    def _is_upheld(self, fact: str, overlays: Iterable[Overlay]) -> bool:
        return any(True for _ in self._prevailing(fact, overlays))

    def _prevailing(self, fact: str, overlays: Iterable[Overlay]) -> Iterator[Source]:
        """The words for a fact that prevail over all those against it."""
        words = self._words(fact, overlays)
        cons = [word for word in words if word.is_against]
        for word in words:
            if not word.is_against and all(stands(word, con) for con in cons):
                yield word

    def _words(self, fact: str, overlays: Iterable[Overlay] | None = None) -> list[Source]:
        words = sorted(self._provenance.of(fact).values(), key=lambda word: word.moment)
        for overlay in self._overlays.values() if overlays is None else overlays:
            words += overlay.words(fact)
        return words

    # Functional predicates

    def _weight(self, fact: str, overlays: Iterable[Overlay]) -> Weight:
        is_observed = parts(fact)[0] in self._observed
        words = self._prevailing(fact, overlays)
        return max(weight(word, is_observed=is_observed) for word in words)

    def _functional_facts(self) -> Iterator[str]:
        if self._functional:
            yield from (f for f in self._provenance if f.partition(" ")[0] in self._functional)

    def _believed_rival(self, fact: str) -> str:
        if parts(fact)[0] not in self._functional or self.holds(fact):
            return ""
        group = group_of(fact)
        return next((f for f in sorted(self.facts) if group_of(f) == group), "")

    # Parking

    def _absent(self, fact: str) -> list[str]:
        if self._objects is None:
            return []
        return [name for name in parts(fact)[1] if name not in self._objects]


def _positive(facts: Iterable[str]) -> frozenset[str]:
    """Facts without twins: a twin holds whenever its fact does not, and needs no word for it."""
    return frozenset(fact for fact in facts if not is_twin(fact))
