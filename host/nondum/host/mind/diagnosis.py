"""Why a goal cannot be had, and who used to supply what it lacks."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Iterator, Mapping

from nondum.host.core.records.payload import FormerPayload
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.mind.lack import Need
from nondum.host.mind.missing_reports import Silence
from nondum.planning.explain.explain import explain, suppliers
from nondum.planning.ground.ground import ground
from nondum.planning.merge.claims import claims_of
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.goal import Goal
from nondum.planning.search import solve
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import FragmentRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import Answer, GroundTask

NO_SILENCE = Silence()

_TRIAL_S = 0.3
"""How long a part of a goal is planned for, to see whether it can be had by itself."""


@frozen
class WhyNot:
    """Why a goal cannot be had."""

    problems: tuple[Problem, ...]
    """In words; empty: it is not known why."""
    needs: tuple[Need, ...] = ()
    """What is missing, as data; empty where nothing is, for example of parts of a goal that exclude
    each other."""


@frozen
class Seen:
    """A component that was here, as it was last."""

    contribution: Contribution
    description: PluginDescription
    payload_id: str
    """The payload that brings it."""
    version: str
    """The payload's."""
    left_wall_s: float
    """When it went, in seconds since 1970."""
    host: str = ""
    """The peer that had it; empty: this host."""

    @classmethod
    def of(cls, former: FormerPayload, host: str) -> Iterator[Seen]:
        """The components of a payload that was here."""
        for component, description in former.components.items():
            contribution = Contribution.from_description(
                description, host=former.host or host, component=component
            )
            yield cls(
                contribution,
                description,
                former.payload_id,
                former.version,
                former.left_wall_s,
                former.host,
            )

    @property
    def payload(self) -> str:
        """The payload's id and version."""
        return f"{self.payload_id} {self.version}"

    @property
    def remedy(self) -> str:
        """How a person gets it back."""
        return f"bring the host {self.host} back" if self.host else f"plug in {self.payload}"


def seen_in(snapshot: Snapshot) -> tuple[Seen, ...]:
    """The components that were here, those that left first come first."""
    return tuple(known for former in snapshot.former for known in Seen.of(former, snapshot.host))


def moment(wall_s: float) -> str:
    """A moment in the past for people: the time, and the date where that was another day."""
    then, now = time.localtime(wall_s), time.localtime()
    return time.strftime("%T" if then[:3] == now[:3] else "%F %T", then)


def why_not(
    merged: Merged,
    goal: Goal,
    facts: frozenset[str],
    seen: Iterable[Seen],
    failures: Mapping[str, str] | None = None,
    silence: Silence = NO_SILENCE,
) -> WhyNot:
    """What is missing for a goal that cannot be reached, and who used to supply it.

    `failures` are the actions that must not be planned with, and how they failed; `silence` is what
    keeps those from telling it that could. Takes its time.
    """
    try:
        diagnosis = explain(merged, facts, goal.expr, search=_tried_out)
        in_the_way = _in_the_way(merged, goal, facts, failures or {})
    except FragmentRefused as refused:
        return WhyNot(refused.problems)
    if in_the_way and not diagnosis.causes:
        reasons = "; ".join(f"{name} {why}" for name, why in sorted(in_the_way.items()))
        message = f"there is no way without what failed again and again: {reasons}"
        fix = "it is tried again after a while"
        return WhyNot((Problem("NO_OTHER_WAY", message, fix=fix),))
    gone = {known.contribution: known for known in seen}
    brought = [gone[contribution] for contribution in suppliers(diagnosis.causes, gone)]
    told = map(silence.problem, diagnosis.causes) if diagnosis.causes else diagnosis.problems()
    needs = tuple(map(silence.need, diagnosis.causes))
    return WhyNot((*told, *_used_to_supply(brought)), needs)


def _in_the_way(
    merged: Merged, goal: Goal, facts: frozenset[str], failures: Mapping[str, str]
) -> Mapping[str, str]:
    """Those of the failed actions that could serve the goal: others failed for other goals."""
    if not failures:
        return failures
    useful = {action.name for action in ground(merged, facts, goal.expr).actions}
    return {name: why for name, why in failures.items() if name in useful} or failures


def _used_to_supply(gone: Iterable[Seen]) -> tuple[Problem, ...]:
    """One problem for all of them; none where there is none."""
    known = sorted(gone, key=lambda seen: seen.contribution.component)
    if not known:
        return ()
    names = ", ".join(seen.contribution.component for seen in known)
    until = moment(max(seen.left_wall_s for seen in known))
    message = f"{names} used to supply it, until {until}"
    return (Problem("WHY_SUPPLIER", message, fix=_remedies(known)),)


def _remedies(gone: Iterable[Seen]) -> str:
    return " or ".join(dict.fromkeys(seen.remedy for seen in gone))


def words_gone(merged: Merged, pddl: str, seen: Iterable[Seen]) -> tuple[Problem, ...]:
    """Which of a goal's words mean nothing any more, and who brought them. Empty: none."""
    lost = {*re.findall(r"[^\s()]+", pddl)} - {*merged.domain.predicates, *merged.objects}
    brought = [(known, lost & _names(known.contribution)) for known in seen]
    words = ", ".join(sorted({repr(word) for _, found in brought for word in found}))
    bringers = [known for known, found in brought if found]
    if not words:
        return ()
    names = ", ".join(sorted(known.contribution.component for known in bringers))
    message = f"{words} means nothing without {names}, which brought it"
    return (Problem("WHY_WORDS_GONE", message, fix=_remedies(bringers)),)


def _names(contribution: Contribution) -> set[str]:
    """The predicates and objects that a contribution declares."""
    claims = claims_of(contribution)
    return {
        *(predicate.name for predicate in claims.predicates),
        *(claim.name for claim in claims.objects),
        *(unit.object for unit in contribution.units),
        *(stream.object for stream in contribution.streams),
    }


def _tried_out(task: GroundTask) -> Answer:
    until_s = time.monotonic() + _TRIAL_S
    return solve(task, lambda: time.monotonic() > until_s)
