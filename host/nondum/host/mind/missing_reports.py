"""Why nothing tells a fact that something here could tell: a condition that has ended, a worker
that is not ready, a device that is not there.

What planning says of such a fact, that nothing here makes it true, holds of actions only.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Any, TypeAlias, cast

from nondum.host.core import waiting
from nondum.host.core.placed import place_of
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.peer import PeerComponent
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.mind.lack import Need
from nondum.planning.explain.cause import Cause, Lack
from nondum.planning.merge.contribution import object_name
from nondum.planning.pddl.facts import parts
from nondum.sdk.codec.values import from_plain, to_plain
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class Reason:
    """What keeps a component from telling, or from being ready."""

    said: str
    """In one clause."""
    waits: bool = False
    """The component is well, and waits for its device."""


Reasons: TypeAlias = Mapping[str, tuple[Reason, ...]]


@frozen
class Silence:
    """What of a host's components tells nothing, or is not ready, and why."""

    untold: Reasons = field(default_factory=dict)
    """Predicate → what keeps each of its conditions from telling it."""
    unready: Reasons = field(default_factory=dict)
    """Unit, or `?plugin.type` for any of them → why it is not ready."""

    @classmethod
    def of(cls, snapshot: Snapshot) -> Silence:
        """What is so at one revision."""
        return cls(_gathered(_untold(snapshot)), _gathered(_unready(snapshot)))

    @classmethod
    def parse(cls, told: Mapping[str, Any]) -> Silence:
        """Read what `to_dict` gave. It comes from our own daemon and is trusted."""
        return from_plain(cls, told)

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return cast(dict[str, Any], to_plain(self))

    def problem(self, cause: Cause) -> Problem:
        """A cause as a problem, with the reason for the silence where there is one."""
        said = self._said(cause)
        found = cause.problem(said)
        return Problem("WHY_NOT_TOLD", found.message) if said and _is_to_be_told(cause) else found

    def need(self, cause: Cause) -> Need:
        """The same as data."""
        waits = any(reason.waits for reason in self._reasons(cause))
        said = self._said(cause) or cause.said
        return Need(self.problem(cause).code, said, cause.fact, cause.types, waits)

    def _said(self, cause: Cause) -> str:
        """What is missing and why, in one clause; empty: nothing is known of that here."""
        because = " and ".join(reason.said for reason in self._reasons(cause))
        first = f"({cause.fact}) is not known" if _is_to_be_told(cause) else cause.said
        return because and f"{first}: {because}"

    def _reasons(self, cause: Cause) -> tuple[Reason, ...]:
        predicate, arguments = parts(cause.fact or "?")
        if _is_to_be_told(cause):
            return self.untold.get(predicate, ())
        if cause.lack is Lack.HOST and predicate == "ready":
            return self.unready.get(arguments[0], ())
        return ()


def _is_to_be_told(cause: Cause) -> bool:
    return cause.lack is Lack.ACTION


def _gathered(pairs: Iterator[tuple[str, Reason]]) -> Reasons:
    found: dict[str, tuple[Reason, ...]] = {}
    for name, reason in pairs:
        found[name] = tuple(dict.fromkeys((*found.get(name, ()), reason)))
    return found


def _untold(snapshot: Snapshot) -> Iterator[tuple[str, Reason]]:
    for _, component in snapshot.everyone():
        for condition in component.description.conditions:
            name = f"{condition.name} of {component.id}"
            reason = _why_silent(name, component)
            yield from ((predicate, reason) for predicate in condition.predicates)


def _why_silent(name: str, component: ComponentRecord | PeerComponent) -> Reason:
    if isinstance(component, ComponentRecord):
        for problem in component.problems:
            place = place_of(problem.where, name)
            if problem.code == "CONDITION_RAISED" and place is not None:
                at = f" at {place}" if place else ""
                return Reason(f"{name} has ended{at}: {problem.message}")
        if not component.is_ready:
            return _why_not_ready(component)
    return Reason(f"{name} has not told it")


def _unready(snapshot: Snapshot) -> Iterator[tuple[str, Reason]]:
    for component in snapshot.components:
        if not component.is_ready:
            reason = _why_not_ready(component)
            for unit in component.description.units:
                yield object_name(snapshot.host, component.id, unit.name), reason
                yield f"?{component.description.name}.{unit.type}", reason


def _why_not_ready(component: ComponentRecord) -> Reason:
    if told := waiting.waits(component):
        return Reason(f"{component.id} {told}", waits=True)
    reason = f", {component.problems[0].message}" if component.problems else ""
    return Reason(f"{component.id} is {component.state.value}{reason}")
