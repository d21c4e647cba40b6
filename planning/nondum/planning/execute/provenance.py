"""Who says what of a fact, and whose word counts."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from enum import Enum
from typing import Any, TypeAlias

from nondum.planning.ground.rivals import Weight, group_of
from nondum.sdk.frozen import frozen


class SourceKind(Enum):
    """What kind of voice speaks."""

    HOST = "host"
    """The host itself: what is plugged in, ready, idle. Only what runs can take it away."""
    OBSERVATION = "observation"
    """A component says so."""
    LASTING = "lasting"
    """A behaviour is established, so its effects are assumed for as long as it runs."""
    EFFECT = "effect"
    """A behaviour succeeded, so its effects are assumed."""
    FRAGMENT = "fragment"
    """A component's problem fragment: a default, applied once, when the component appears."""


@frozen
class Source:
    """One voice's word for or against a fact."""

    kind: SourceKind
    who: str
    """The component that the word goes away with; the host's name for the host's own."""
    said: str
    """In words, for people: `behaviour localise succeeded`."""
    at_s: float
    value: Any = None
    """What a valued fact carries beside it."""
    is_against: bool = False
    action: str = ""
    """The bound action whose effect it is, where it is one's."""
    number: int = 0
    """Counts up with every word: of two words of one moment, the later one is the newer."""

    @property
    def moment(self) -> tuple[float, int]:
        """When it was said; the greater is the newer."""
        return self.at_s, self.number


Voice: TypeAlias = tuple[SourceKind, str]
"""What kind of source, and who."""


def stands(pro: Source, con: Source) -> bool:
    """Whether a word for a fact stands against one against it.

    The host is believed but for what a running behaviour takes; observers do not silence each
    other; a default gives way to everybody; of the rest, the newer word counts.
    """
    match pro.kind:
        case SourceKind.HOST:
            return con.kind is not SourceKind.LASTING
        case SourceKind.OBSERVATION if con.kind is SourceKind.OBSERVATION:
            return True
        case SourceKind.FRAGMENT:
            return False
        case _:
            return pro.moment > con.moment


def weight(pro: Source, *, is_observed: bool) -> Weight:
    """Sort key of words for rival values of a functional predicate: the heaviest is believed.

    A default weighs least; of live words the newest counts, but where conditions observe the
    predicate, their word counts before what is assumed.
    """
    is_firm = pro.kind is SourceKind.HOST or (is_observed and pro.kind is SourceKind.OBSERVATION)
    rank = 2 if is_firm else 0 if pro.kind is SourceKind.FRAGMENT else 1
    return rank, *pro.moment


@frozen
class Overlay:
    """The effects of an established lasting behaviour."""

    add: frozenset[str]
    delete: frozenset[str]
    source: Source

    def words(self, fact: str) -> Iterator[Source]:
        """What it says of a fact."""
        if fact in self.add:
            yield self.source
        elif fact in self.delete:
            yield replace(self.source, is_against=True)


@frozen
class Evidence:
    """All that is known about one fact."""

    fact: str
    holds: bool
    pros: tuple[Source, ...]
    """Words for it, oldest first."""
    cons: tuple[Source, ...]
    """Words against it, oldest first."""
    rival: str = ""
    """The other value that is believed of a functional predicate."""
    absent: tuple[str, ...] = ()
    """Objects that it names and that are not there: it is parked until they are."""

    @property
    def since_s(self) -> float | None:
        """Since when a component or the host has said so; None: none does."""
        return min((source.at_s for source in self.pros), default=None)


class Provenance:
    """Every word on every fact. A voice says one thing of a fact: what it said last."""

    __test__ = False  # its name looks like one of a test's

    def __init__(self) -> None:
        self._words: dict[str, dict[Voice, Source]] = {}
        self._contested: set[str] = set()
        self._groups: dict[str, set[str]] = {}

    def __contains__(self, fact: object) -> bool:
        """Whether anybody says anything of a fact."""
        return fact in self._words

    def __iter__(self) -> Iterator[str]:
        """The facts that anything is said of."""
        return iter(tuple(self._words))

    @property
    def contested(self) -> Collection[str]:
        """The facts that somebody speaks against."""
        return self._contested

    def uncontested(self) -> set[str]:
        """The facts with a word for them and none against them."""
        return self._words.keys() - self._contested

    def of(self, fact: str) -> Mapping[Voice, Source]:
        """All words on a fact."""
        return self._words.get(fact, {})

    def rivals(self, fact: str) -> Iterable[str]:
        """Other facts that differ in the last argument only."""
        return self._groups.get(group_of(fact), set()) - {fact}

    def take(self, fact: str, source: Source) -> None:
        """Keep a word, in the place of what the same voice said of the fact before."""
        if fact not in self._words:
            self._words[fact] = {}
            self._groups.setdefault(group_of(fact), set()).add(fact)
        self._words[fact][source.kind, source.who] = source
        self._weigh(fact)

    def drop(self, fact: str, voice: Voice) -> bool:
        """Forget what a voice said of a fact, and say whether it had said anything."""
        words = self._words.get(fact, {})
        if words.pop(voice, None) is None:
            return False
        if not words:
            del self._words[fact]
            group = self._groups[group_of(fact)]
            group.discard(fact)
            if not group:
                del self._groups[group_of(fact)]
        self._weigh(fact)
        return True

    def _weigh(self, fact: str) -> None:
        if any(source.is_against for source in self.of(fact).values()):
            self._contested.add(fact)
        else:
            self._contested.discard(fact)
