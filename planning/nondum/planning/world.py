"""The world model: what the robot believes, where it has each belief from, and since when.

A fact holds while somebody live supports it: the host, a fragment, a component that says so, or a
behaviour that succeeded. On top lie the effects of established lasting behaviours, for as long as
they run. What a component observes beats what others assume. There is no clock: times are passed
in, in seconds, and only shown.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, TypeAlias

from nondum.planning.facts import is_twin, parts


class SourceKind(Enum):
    """What kind of voice supports a fact."""

    HOST = "host"
    """The host itself: what is plugged in, ready, idle. Nobody else can deny it."""
    FRAGMENT = "fragment"
    """A component's problem fragment; applied once, when the component appears."""
    OBSERVATION = "observation"
    """A component says so, now."""
    EFFECT = "effect"
    """A behaviour succeeded, so it is assumed."""


@dataclass(frozen=True, slots=True)
class Source:
    """One voice for or against a fact."""

    kind: SourceKind
    who: str
    """The component that the belief goes away with; the host's name for the host's own."""
    said: str
    """In words, for people: `behaviour localise succeeded`."""
    at_s: float
    value: Any = None
    """What a valued fact carries beside it."""


@dataclass(frozen=True, slots=True)
class Overlay:
    """The effects of an established lasting behaviour."""

    add: frozenset[str]
    delete: frozenset[str]
    source: Source


Voice: TypeAlias = tuple[SourceKind, str]
"""What kind of source, and who."""

_FIRM = (SourceKind.HOST, SourceKind.OBSERVATION)
_ASSUMED = (SourceKind.FRAGMENT, SourceKind.EFFECT)


class WorldModel:
    """Everything that is believed. Satisfies `running.World`."""

    def __init__(self) -> None:
        self.revision = 0
        """Rises with every change."""
        self._supports: dict[str, dict[Voice, Source]] = {}
        self._denials: dict[str, Source] = {}
        self._overlays: dict[str, Overlay] = {}
        self._seeded: dict[str, frozenset[str]] = {}
        self._observed: frozenset[str] = frozenset()
        self._objects: frozenset[str] | None = None
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
        return max(valued, key=lambda source: source.at_s).value if valued else None

    def sources(self, fact: str) -> tuple[Source, ...]:
        """Who supports a fact, oldest first; lasting behaviours last."""
        found = sorted(self._supports.get(fact, {}).values(), key=lambda s: s.at_s)
        return (*found, *(o.source for o in self._overlays.values() if fact in o.add))

    def why(self, fact: str) -> tuple[str, ...]:
        """Sentences that explain why a fact holds or does not."""
        verdict = "holds" if self.holds(fact) else "does not hold"
        lines = [f"({fact}) {verdict}"]
        lines += [f"for it: {source.said}" for source in self.sources(fact)]
        if denial := self._denials.get(fact):
            lines.append(f"against it: {denial.said}")
        lines += [
            f"against it: {o.source.said}" for o in self._overlays.values() if fact in o.delete
        ]
        if unknown := self._unknown_objects(fact):
            lines.append(f"parked: there is no object {', '.join(unknown)} now")
        if len(lines) == 1:
            lines.append("nobody has said so")
        return tuple(lines)

    # What the host knows

    def frame(self, *, objects: frozenset[str], observed: frozenset[str]) -> None:
        """Say which objects there are, and which predicates components observe.

        Facts about other objects are parked until the object appears. The effects of behaviours on
        observed predicates are not assumed but waited for.
        """
        if (objects, observed) != (self._objects, self._observed):
            self._objects, self._observed = objects, observed
            self._changed()

    def set_host_facts(self, host: str, facts: Mapping[str, str], at_s: float) -> None:
        """Replace all that the host itself asserts: fact → why, in words."""
        key = (SourceKind.HOST, host)
        for fact in [f for f, voices in self._supports.items() if key in voices]:
            if fact not in facts:
                self._silence(fact, [key])
        for fact, said in facts.items():
            if key not in self._voices(fact):
                self._support(fact, Source(SourceKind.HOST, host, said, at_s))

    def seed(self, component: str, facts: Iterable[str], at_s: float) -> None:
        """Apply a component's problem fragment; again only for facts that it did not have."""
        facts = frozenset(facts)
        for fact in sorted(facts - self._seeded.get(component, frozenset())):
            said = f"the fragment of {component} says so"
            self._support(fact, Source(SourceKind.FRAGMENT, component, said, at_s))
        self._seeded[component] = facts

    # What components say

    def know(self, fact: str, component: str, at_s: float, *, value: Any = None) -> None:
        """A component says that a fact holds, perhaps with a value."""
        self._undeny(fact)
        said = f"{component} says so"
        self._support(fact, Source(SourceKind.OBSERVATION, component, said, at_s, value))

    def forget(self, fact: str, component: str, at_s: float) -> None:
        """A component says that a fact does not hold (any more).

        What others observe and what the host knows stays; what was only assumed goes.
        """
        own = (SourceKind.OBSERVATION, component)
        self._silence(fact, [v for v in self._voices(fact) if v == own or v[0] in _ASSUMED])
        said = f"{component} says that it does not hold"
        self._deny(fact, Source(SourceKind.OBSERVATION, component, said, at_s))

    def recant(self, fact: str, component: str) -> None:
        """A component takes back what it said against a fact, without saying that it holds."""
        denial = self._denials.get(fact)
        if denial and denial.who == component:
            self._undeny(fact)

    def silence(self, component: str) -> None:
        """A component can say nothing any more: what it observes and what it runs is unknown."""
        voice = (SourceKind.OBSERVATION, component)
        for fact in [f for f, voices in self._supports.items() if voice in voices]:
            self._silence(fact, [voice])
        for name in [n for n, o in self._overlays.items() if o.source.who == component]:
            self.end(name)

    # What behaviours do

    def establish(
        self, name: str, component: str, *, add: Iterable[str], delete: Iterable[str], at_s: float
    ) -> None:
        """The effects of a lasting behaviour hold from now until `end`."""
        added = _positive(add)
        for fact in added:
            self._undeny(fact)
        source = Source(SourceKind.EFFECT, component, f"{name} is established", at_s)
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
        source = Source(SourceKind.EFFECT, component, f"{name} succeeded", at_s)
        for fact in _positive(delete) - added:
            if parts(fact)[0] not in self._observed:
                self._silence(fact, [v for v in self._voices(fact) if v[0] is not SourceKind.HOST])
                self._deny(fact, replace(source, said=f"{name} succeeded and ended it"))
        for fact in added:
            if parts(fact)[0] not in self._observed:
                self._undeny(fact)
                self._support(fact, source)

    # What goes away

    def remove_component(self, component: str, objects: Collection[str]) -> None:
        """Retract all that a component supports, denies and runs, and all about its objects."""
        for fact in list(self._supports):
            is_about = not set(parts(fact)[1]).isdisjoint(objects)
            self._silence(fact, [v for v in self._voices(fact) if is_about or v[1] == component])
        self._denials = {f: s for f, s in self._denials.items() if s.who != component}
        self._overlays = {n: o for n, o in self._overlays.items() if o.source.who != component}
        self._seeded.pop(component, None)
        self._changed()

    def _voices(self, fact: str) -> Mapping[Voice, Source]:
        return self._supports.get(fact, {})

    def _support(self, fact: str, source: Source) -> None:
        voices = self._supports.setdefault(fact, {})
        is_new = not voices
        voices[source.kind, source.who] = source
        if is_new or fact in self._denials:  # else no other fact is true than before
            self._changed()

    def _silence(self, fact: str, voices: Collection[Voice]) -> None:
        for voice in voices:
            del self._supports[fact][voice]
        if voices:
            if not self._supports[fact]:
                del self._supports[fact]
            self._changed()

    def _deny(self, fact: str, source: Source) -> None:
        self._denials[fact] = source
        self._changed()

    def _undeny(self, fact: str) -> None:
        if self._denials.pop(fact, None):
            self._changed()

    def _changed(self) -> None:
        self.revision += 1
        self._facts = self._bare = None

    def _holding(self, overlays: Iterable[Overlay]) -> frozenset[str]:
        overlays = tuple(overlays)
        added = frozenset[str]().union(*(o.add for o in overlays)) - self._denials.keys()
        deleted = frozenset[str]().union(*(o.delete for o in overlays))
        facts = {fact for fact in self._supports if fact not in deleted} | added
        for fact in self._denials.keys() & facts:
            if not any(kind in _FIRM for kind, _ in self._voices(fact)):
                facts.discard(fact)
        if self._objects is not None:
            facts = {fact for fact in facts if not self._unknown_objects(fact)}
        return frozenset(facts)

    def _unknown_objects(self, fact: str) -> list[str]:
        if self._objects is None:
            return []
        return [name for name in parts(fact)[1] if name not in self._objects]


def _positive(facts: Iterable[str]) -> frozenset[str]:
    """Facts without twins: a twin holds when its fact does not, nobody has to say so."""
    return frozenset(fact for fact in facts if not is_twin(fact))
