"""Why nothing tells a fact that something here could tell: a condition that has ended, a worker
that is not ready, a device that is not there.

What planning says of such a fact, that nothing here makes it true, holds of actions only.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from nondum.host import missing_devices
from nondum.host.catalogue.records import ComponentRecord, PeerComponent, Snapshot
from nondum.planning.cause import Cause, Lack
from nondum.planning.contribution import object_name
from nondum.planning.facts import parts
from nondum.sdk.errors import Problem

Reasons: TypeAlias = Mapping[str, tuple[str, ...]]


@dataclass(frozen=True, slots=True)
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
        return cls(
            {name: tuple(reasons) for name, reasons in told["untold"].items()},
            {name: tuple(reasons) for name, reasons in told["unready"].items()},
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "untold": {name: list(reasons) for name, reasons in self.untold.items()},
            "unready": {name: list(reasons) for name, reasons in self.unready.items()},
        }

    def problem(self, cause: Cause) -> Problem:
        """A cause as a problem, with the reason for the silence where there is one."""
        found, (predicate, arguments) = cause.problem(), parts(cause.fact or "?")
        if cause.lack is Lack.ACTION and predicate in self.untold:
            because = " and ".join(self.untold[predicate])
            said = f"({cause.fact}) is not known: {because}"
            return Problem("WHY_NOT_TOLD", found.message.replace(cause.said, said, 1))
        if cause.lack is Lack.HOST and predicate == "ready" and arguments[0] in self.unready:
            because = " and ".join(self.unready[arguments[0]])
            said = f"{cause.said}: {because}"
            return replace(found, message=found.message.replace(cause.said, said, 1))
        return found


def _gathered(pairs: Iterator[tuple[str, str]]) -> Reasons:
    found: dict[str, tuple[str, ...]] = {}
    for name, reason in pairs:
        found[name] = tuple(dict.fromkeys((*found.get(name, ()), reason)))
    return found


def _untold(snapshot: Snapshot) -> Iterator[tuple[str, str]]:
    for _, component in snapshot.everyone():
        for condition in component.description.conditions:
            name = f"{condition.name} of {component.id}"
            reason = _why_silent(name, component)
            yield from ((predicate, reason) for predicate in condition.predicates)


def _why_silent(name: str, component: ComponentRecord | PeerComponent) -> str:
    if isinstance(component, ComponentRecord):
        for problem in component.problems:
            condition, _, place = problem.where.partition(" (")
            if problem.code == "CONDITION_RAISED" and condition == name:
                at = f" at {place.rstrip(')')}" if place else ""
                return f"{name} has ended{at}: {problem.message}"
        if not component.is_ready:
            return _why_not_ready(component)
    return f"{name} has not told it"


def _unready(snapshot: Snapshot) -> Iterator[tuple[str, str]]:
    for component in snapshot.components:
        if not component.is_ready:
            reason = _why_not_ready(component)
            for unit in component.description.units:
                yield object_name(snapshot.host, component.id, unit.name), reason
                yield f"?{component.description.name}.{unit.type}", reason


def _why_not_ready(component: ComponentRecord) -> str:
    if told := missing_devices.waits(component):
        return f"{component.id} {told}"
    reason = f", {component.problems[0].message}" if component.problems else ""
    return f"{component.id} is {component.state.value}{reason}"
