"""The world model kept up to date: snapshots of the catalogue and news of workers in, facts out."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Mapping

from nondum.host.core.events.event import Event
from nondum.host.core.events.facts import FactForgotten, FactKnown, StreamFlowing, UnitsTaken
from nondum.host.core.events.workers import WorkerExited
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.mind.composition import Composition, always_produced, body_facts, own_objects
from nondum.planning.execute.world import WorldModel
from nondum.planning.merge.core import HOST_PREDICATES
from nondum.planning.merge.scope import SELF
from nondum.planning.pddl.facts import fact, is_twin
from nondum.sdk.errors import Problem

log = logging.getLogger(__name__)

_NAME = re.compile(r"[^\s()]+")
"""A space in a name would make another fact of it, perhaps one of the host's."""


class Beliefs:
    """What this host believes, and how it comes to."""

    def __init__(self, host: str, now_s: Callable[[], float]) -> None:
        """`now_s` is the clock that facts are stamped with, in seconds."""
        self.world = WorldModel()
        self.snapshot = Snapshot(host, revision=0)
        self.flowing: frozenset[str] = frozenset()
        """Streams that messages arrive on."""
        self.now_s = now_s
        """The clock, in seconds."""
        self._names: dict[str, Mapping[str, str]] = {}
        self._always: frozenset[str] = frozenset()
        self._taken: dict[str, Mapping[str, str]] = {}
        """Host that told → facts that do not hold, since somebody else uses what they are about."""
        self._looked_at = -1
        self._contradicted: frozenset[str] = frozenset()

    def see(self, snapshot: Snapshot) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Take over a snapshot; what is gone from it is withdrawn at once.

        Gives the ids of the components that are gone, and of those that are new.
        """
        old, self.snapshot = self.snapshot, snapshot
        before = {(c.id, c.payload) for _, c in old.everyone()}
        now = {(c.id, c.payload) for _, c in snapshot.everyone()}
        gone = [(host, c) for host, c in old.everyone() if (c.id, c.payload) not in now]
        for host, component in gone:
            objects = own_objects(host, component).values()
            self.world.remove_component(component.id, set(objects))
            self.flowing -= set(objects)
        self._names = {c.id: own_objects(host, c) for host, c in snapshot.everyone()}
        self._always = always_produced(snapshot)
        self._say_as_host()
        new = (c.id for _, c in snapshot.everyone() if (c.id, c.payload) not in before)
        return tuple(component.id for _, component in gone), tuple(new)

    def _say_as_host(self) -> None:
        """Assert what the host knows by itself, but for what others have in use."""
        facts = body_facts(self.snapshot)
        for taken in self._taken.values():
            for text in taken:
                facts.pop(text, None)
        self.world.set_host_facts(self.snapshot.host, facts, self.now_s())

    def adopt(self, composition: Composition) -> None:
        """Take over what merging made of the snapshot: objects, and what fragments say."""
        predicates = composition.merged.domain.predicates.values()
        self.world.frame(
            objects=composition.objects,
            observed=composition.observed,
            functional=frozenset(p.name for p in predicates if p.functional),
        )
        now_s = self.now_s()
        for component, facts in sorted(composition.seeds().items()):
            self.world.seed(component, facts, now_s)

    def new_conflicts(self) -> tuple[Problem, ...]:
        """Where components contradict each other and did not when this was last asked."""
        if self._looked_at == self.world.revision:
            return ()
        self._looked_at = self.world.revision
        before, found = self._contradicted, self.world.conflicts()
        self._contradicted = frozenset(problem.where for problem in found)
        return tuple(problem for problem in found if problem.where not in before)

    def on_event(self, event: Event) -> bool:
        """Take in news of a worker. Says whether it was news for the world model."""
        match event:
            case FactKnown(component, predicate, arguments, value) if self._may_say(event):
                text = self._text(component, predicate, arguments)
                self.world.know(text, component, self.now_s(), value=value)
            case FactForgotten(component, predicate, arguments) if self._may_say(event):
                text = self._text(component, predicate, arguments)
                self.world.forget(text, component, self.now_s())
            case StreamFlowing(component, stream, flowing) if component in self._names:
                self._on_flow(component, stream, is_flowing=flowing)
            case UnitsTaken(host, taken):
                self._taken[host] = taken
                self._say_as_host()
            case WorkerExited(component):
                self.world.silence(component)
                self.flowing -= set(self._names.get(component, {}).values())
            case _:
                return False
        return True

    def _may_say(self, event: FactKnown | FactForgotten) -> bool:
        """Whether a component may state a fact: it is here, and the host does not state it."""
        if event.component not in self._names:
            return False
        if event.predicate in HOST_PREDICATES:
            log.warning("%s may not say (%s …): the host does", event.component, event.predicate)
            return False
        words = (event.predicate, *event.arguments)
        if is_twin(event.predicate) or not all(map(_NAME.fullmatch, words)):
            log.warning("%s says what is no fact: %r", event.component, words)
            return False
        return True

    def _text(self, component: str, predicate: str, arguments: tuple[str, ...]) -> str:
        """A fact with full object names: components may use their local ones, and `self`."""
        names = {SELF: self.snapshot.host, **self._names[component]}
        return fact(predicate, *(names.get(argument, argument) for argument in arguments))

    def _on_flow(self, component: str, stream: str, *, is_flowing: bool) -> None:
        """A stream that a behaviour produces flows while the behaviour is established; news of it
        can only say that it has stalled. One that is always produced flows while it is said to."""
        text, now_s = fact("flowing", stream), self.now_s()
        self.flowing = self.flowing | {stream} if is_flowing else self.flowing - {stream}
        if not is_flowing:
            self.world.forget(text, component, now_s)
        elif stream in self._always:
            self.world.know(text, component, now_s)
        else:
            self.world.recant(text, component)
