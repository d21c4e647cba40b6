"""Why a goal cannot be had and what would help, worked out outside the daemon.

A daemon tells what planning goes by (the verb `composition`); the search takes none of its time.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from nondum.cli.shelf import Shelved, candidate_of, distinct, on_shelf
from nondum.cli.shelf_names import ShelfNames
from nondum.host.mind.diagnosis import NO_SILENCE, Seen, moment, why_not, words_gone
from nondum.host.mind.missing_reports import Silence
from nondum.host.sources.devices.view import device_of
from nondum.planning.explain.advise import Advice, Candidate, Here, advise, understood
from nondum.planning.merge.contribution import Contribution, id_at_home
from nondum.planning.merge.goal import GoalKind, goal_text, parse_goal
from nondum.planning.merge.merge import merge
from nondum.planning.search import solve
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import GoalRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import Answer, GroundTask
from nondum.wheelhouse.payload.host_facts import HostFacts

WAYS_LIMIT = 10
"""The largest number of alternatives that are shown."""
_SEARCH_S = 2.0
"""How long is planned with one set of payloads."""
_GLANCE_TRIALS = 12
_GLANCE_S = 1.0
"""How many sets of payloads are planned with for the sake of a sentence, and how long in all."""


@frozen
class Counsel:
    """All that is told of one goal."""

    goal: str
    """In PDDL."""
    kind: GoalKind
    advice: Advice
    causes: tuple[Problem, ...]
    """Why it cannot be had now; empty if it can."""
    known: int
    """How many payloads are known of that are not at work."""
    left_out: tuple[Candidate, ...]
    """Payloads of which nothing, or not every component, could be planned with here, and that are
    in none of the ways; their caveats say why."""


@frozen
class Surroundings:
    """A host, what it remembers, and the payloads around it."""

    here: Here
    seen: tuple[Seen, ...]
    failures: Mapping[str, str]
    silence: Silence
    candidates: tuple[Candidate, ...]
    flawed: tuple[Candidate, ...]
    """Those with components whose fragments are wrong."""

    @classmethod
    def of(cls, told: Mapping[str, Any], shelf: Iterable[Shelved]) -> Surroundings:
        """What a daemon told, and payloads from elsewhere."""
        host = told["host"]
        devices = tuple(map(device_of, told["devices"])) if "devices" in told else None
        seen = tuple(seen_of(row, host) for row in told["seen"])
        present = tuple(
            Contribution.from_description(
                _description(row), host=row["host"], component=row["component"], rank=row["rank"]
            )
            for row in told["components"]
        )
        at_work = {contribution.component for contribution in present}
        own = [
            (row["payload"], row["component"], _description(row))
            for row in told["components"]
            if row["host"] == host
        ]
        called = ShelfNames.of(told["names"], own).called(distinct((*shelf, *remembered(seen))))
        known = [payload for payload in called if not at_work.issuperset(payload.components)]
        candidates = tuple(candidate_of(payload, host, devices) for payload in known)
        return cls(
            Here(host, present, frozenset(told["facts"]), frozenset(told["excluded"])),
            seen,
            told["excluded"],
            Silence.parse(told["silence"]) if "silence" in told else NO_SILENCE,
            candidates,
            tuple(
                candidate
                for candidate, payload in zip(candidates, known, strict=True)
                if len(candidate.contributions) < len(payload.components)
            ),
        )

    @classmethod
    def bare(cls, host: str, shelf: Iterable[Shelved]) -> Surroundings:
        """A host with nothing plugged in, and payloads from elsewhere."""
        told = {"host": host, "components": [], "facts": [f"self {host}"], "excluded": {}}
        return cls.of({**told, "names": {}, "seen": []}, shelf)

    def counsel(self, asked: str) -> Counsel:
        """Advise on a goal in words, or in PDDL where it begins with a parenthesis.

        Raises `GoalRefused`.
        """
        goal: str = asked
        kind: GoalKind = "achieve"
        if not asked.lstrip().startswith("("):
            meant = understood(asked, self.here, self.candidates)
            goal, kind = goal_text(meant.expr), meant.kind
        advice = advise(self.here, goal, self.candidates, _search, ways_limit=WAYS_LIMIT)
        causes = () if advice.now else self._causes(goal, advice)
        known = len(self.candidates)
        return Counsel(goal, kind, advice, causes, known, self._left_out(advice))

    def glance(self, goal: str) -> Advice:
        """What would help towards a goal in PDDL, as far as that is found at once.

        Raises `GoalRefused`.
        """
        until_s = time.monotonic() + _GLANCE_S

        def search(task: GroundTask) -> Answer:
            return solve(task, lambda: time.monotonic() > until_s)

        return advise(
            self.here,
            goal,
            self.candidates,
            search,
            ways_limit=WAYS_LIMIT,
            trials_limit=_GLANCE_TRIALS,
        )

    def _left_out(self, advice: Advice) -> tuple[Candidate, ...]:
        told = {c.name for c in advice.unfit} | {c.name for w in advice.ways for c in w.payloads}
        return (*advice.unfit, *(c for c in self.flawed if c.name not in told))

    def _causes(self, goal: str, advice: Advice) -> tuple[Problem, ...]:
        """Why the goal cannot be had. Raises `GoalRefused` for a goal with unknown words."""
        merged = merge(self.here.contributions, self.here.host)
        try:
            parsed = parse_goal(goal, merged)
        except GoalRefused:
            # Words that come with what would help are no mistake.
            gone = words_gone(merged, goal, self.seen)
            return gone if advice.ways else self._lacking_still(goal)
        facts = self.here.facts
        return why_not(merged, parsed, facts, self.seen, self.failures, self.silence).problems

    def _lacking_still(self, goal: str) -> tuple[Problem, ...]:
        """What a goal lacks even if all payloads were here; raises `GoalRefused` for words that
        mean nothing then either."""
        together = self.here.beside(self.candidates)
        merged = merge(together.contributions, together.host)
        parsed = parse_goal(goal, merged)
        return why_not(merged, parsed, together.facts | merged.init.keys(), self.seen).problems


def waiting(told: Mapping[str, Any], facts: HostFacts | None) -> Iterable[Shelved | Problem]:
    """The payloads that a daemon has not got to work, as far as their drives can be read."""
    for row in told["waiting"]:
        refusal = tuple(Problem(**problem) for problem in row["problems"])
        for name, folder in row["folders"].items():
            for found in on_shelf(Path(folder), facts) if Path(folder).is_dir() else ():
                if isinstance(found, Shelved):
                    yield Shelved(found.id, found.version, name, found.components, refusal)


def remembered(seen: Iterable[Seen]) -> list[Shelved]:
    """The payloads of components that were here, with those of their components that were."""
    found: dict[tuple[str, str], dict[str, PluginDescription]] = {}
    left: dict[tuple[str, str], float] = {}
    for known in seen:
        key = (known.payload_id, known.version)
        found.setdefault(key, {})[id_at_home(known.contribution.component)] = known.description
        left[key] = known.left_wall_s
    return [
        Shelved(*key, f"here until {moment(left[key])}", described)
        for key, described in found.items()
    ]


def seen_of(row: Mapping[str, Any], host: str) -> Seen:
    """A component that was here or on a peer, as the daemon of `host` tells of it."""
    description = _description(row)
    contribution = Contribution.from_description(
        description, host=row["host"] or host, component=row["component"]
    )
    return Seen(contribution, description, row["payload"], row["version"], row["left"], row["host"])


def _description(row: Mapping[str, Any]) -> PluginDescription:
    return PluginDescription.parse(row["description"], where=row["component"])


def _search(task: GroundTask) -> Answer:
    until_s = time.monotonic() + _SEARCH_S
    return solve(task, lambda: time.monotonic() > until_s)
