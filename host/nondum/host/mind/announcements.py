"""What people are told: sentences in the order things happened, never taken back.

What a sentence is about may be gone since; then it is over.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

from nondum.host.core import waiting
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.peer import PeerComponent
from nondum.host.mind.composition import Composition
from nondum.host.mind.frames import mount_warnings
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

MAX_SENTENCES = 1000
MAX_CHARACTERS = 4096
"""Of a sentence: strangers' payloads can be wrong at great length."""

_Component: TypeAlias = ComponentRecord | PeerComponent


NEWEST = 3
"""Sentences that are looked at where only the last ones count."""


@frozen
class Told:
    """One sentence."""

    number: int
    """Counts up from 1, so that a reader can ask for what is new."""
    wall_s: float
    """Seconds since the epoch."""
    text: str
    about: str = ""
    """What it is about, where that can be gone: `drive sdb1-7`."""
    is_over: bool = False
    """Whether that is gone."""
    is_answer: bool = False
    """Whether it only says again what was known: somebody asked."""

    def to_dict(self) -> dict[str, Any]:
        """Plain data for people's tools."""
        row = {"number": self.number, "when": self.wall_s, "text": self.text}
        return {**row, "over": self.is_over}


class People:
    """Everything that people were told since the host started, the last thousand sentences."""

    def __init__(self, wall_s: Callable[[], float], short: Callable[[str], str] = str) -> None:
        """`short` makes names of units and streams in a sentence as short as can be."""
        self._wall_s, self._short = wall_s, short
        self._told: deque[Told] = deque(maxlen=MAX_SENTENCES)
        self._number = 0

    def __iter__(self) -> Iterator[Told]:
        """The sentences, oldest first."""
        return iter(tuple(self._told))

    @property
    def last_number(self) -> int:
        """How many sentences there were."""
        return self._number

    def since(self, number: int) -> tuple[Told, ...]:
        """What was told after the sentence of that number."""
        return tuple(told for told in self._told if told.number > number)

    def newest(self) -> list[str]:
        """The last `NEWEST` sentences, the newest last."""
        return [told.text for told in self.since(self._number - NEWEST)]

    def tell(self, text: str, about: str = "", *, is_answer: bool = False) -> None:
        """Say a sentence, `about` something that may be gone some time."""
        self._number += 1
        text = self._short(text)
        kept = text if len(text) <= MAX_CHARACTERS else f"{text[:MAX_CHARACTERS]}…"
        self._told.append(Told(self._number, self._wall_s(), kept, about, is_answer=is_answer))

    def end(self, about: str) -> None:
        """What sentences were about is gone."""
        for index, told in enumerate(self._told):
            if told.about == about:
                self._told[index] = replace(told, is_over=True)


def recomposed(old: Composition | None, new: Composition) -> list[str]:
    """Sentences on what a recomposition gains, loses and changes."""
    before = {c.id: c for _, c in old.snapshot.everyone()} if old else {}
    after = {c.id: c for _, c in new.snapshot.everyone()}
    sentences = [f"{id} is gone: {_offered(before[id])}" for id in before if id not in after]
    for id, component in after.items():
        earlier = before.get(id)
        if earlier is not None and earlier.version != component.version:
            sentences.append(f"{id} is now version {component.version}: {_offers(component)}")
        elif earlier is None or earlier.payload != component.payload:
            sentences.append(f"{id} {_arrives(component)}")
        elif earlier.is_ready != component.is_ready:
            sentences.append(f"{id} {_health(component)}")
    return sentences + _contested(old, new) + _doubts(old, new)


def _contested(old: Composition | None, new: Composition) -> list[str]:
    """Which component has a device that other ones want too, and by what rule."""
    known = {c.id: c.devices for c in old.snapshot.components} if old else {}
    return [
        f"{component.id} has the device {claim.device}, which {' and '.join(claim.contested_by)} "
        "would need too: it stays with that component; a free device goes to the first by name"
        for component in new.snapshot.components
        for claim in component.devices
        if claim.contested_by and claim not in known.get(component.id, ())
    ]


def _doubts(old: Composition | None, new: Composition) -> list[str]:
    known = set(old.snapshot.mounts) if old else set()
    return list(mount_warnings(mount for mount in new.snapshot.mounts if mount not in known))


def kept_out(
    people: People, before: Mapping[str, Sequence[Problem]], now: Mapping[str, Sequence[Problem]]
) -> None:
    """Tell which components are not planned with, and why; what was told is over with its cause."""
    for component in {**before, **now}:
        if before.get(component) == now.get(component):
            continue
        about = f"kept out {component}"
        people.end(about)
        for problem in now.get(component, ()):
            people.tell(f"{component} is kept out of planning: {problem}", about)


def _offers(component: _Component) -> str:
    if names := _abilities(component):
        return f"it can {names}"
    if isinstance(component, PeerComponent) and component.description.behaviours:
        return "its host does not offer what it can do"
    return "it has no behaviours"


def _offered(component: _Component) -> str:
    names = _abilities(component)
    return f"it could {names}" if names else "it had no behaviours"


def _abilities(component: _Component) -> str:
    return ", ".join(component.abilities)


def _arrives(component: _Component) -> str:
    """What it can do if it is ready; else what it waits for."""
    if component.is_ready:
        return f"is here: {_offers(component)}"
    names = _abilities(component)
    return f"{_health(component)}{f'; then it can {names}' if names else ''}"


def _health(component: _Component) -> str:
    if component.is_ready:
        return "is ready"
    if isinstance(component, PeerComponent):
        return "is not ready, says its host"
    if told := waiting.waits(component):
        return told
    reason = f": {component.problems[0]}" if component.problems else ""
    return f"is not ready, it is {component.state.value}{reason}"
