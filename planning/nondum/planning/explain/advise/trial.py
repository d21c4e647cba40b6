"""What would be if certain payloads were here: they are merged, grounded and planned with."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from enum import Enum, auto

from nondum.planning.explain.advise.candidate import Candidate, Here
from nondum.planning.explain.conflict import Search
from nondum.planning.ground.bounds import TooManyBindings
from nondum.planning.ground.delete_relaxation import quick_answer
from nondum.planning.ground.ground import ground
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import Merged, Origin
from nondum.planning.merge.goal import GoalExpr, parse_goal
from nondum.planning.merge.merge import merge
from nondum.planning.pddl.facts import parts
from nondum.planning.search.interruptions import cut_short
from nondum.planning.search.validate import validate
from nondum.sdk.errors import FragmentRefused, GoalRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import AlreadyTrue, GroundTask, Plan, Unsolvable

Chosen = frozenset[int]
"""Candidates, by number."""


class Outcome(Enum):
    """What came of a trial."""

    POSSIBLE = auto()
    """There is a plan, and it was checked."""
    IMPOSSIBLE = auto()
    """It is proven that there is none."""
    CONFLICT = auto()
    """Some of it would be kept out of planning, or cannot be here together."""
    UNKNOWN = auto()
    """It was not found out within bounds."""


@frozen
class Trial:
    """One set of payloads, tried out."""

    outcome: Outcome
    merged: Merged | None = None
    goal: GoalExpr | None = None
    task: GroundTask | None = None
    plan: Plan | None = None
    oversized: Mapping[int, Problem] = field(default_factory=dict)
    """The candidates with too many ways to act, and the problem."""


class Trials:
    """Tries out sets of candidates, each once."""

    def __init__(
        self, here: Here, goal: str, candidates: Sequence[Candidate], search: Search
    ) -> None:
        """`goal` is PDDL, for its words may come with a candidate."""
        self.candidates = tuple(candidates)
        self.count = 0
        """How many were planned for."""
        self._here = here
        self._goal = goal
        self._search = search
        self._known: dict[Chosen, Trial] = {}
        self._conflicts: dict[Chosen, bool] = {}
        self._merges: dict[Chosen, Merged] = {}
        rank = max((c.rank for c in here.contributions), default=0) + 1
        self._contributions = [
            tuple(replace(c, rank=rank) for c in candidate.contributions)
            for candidate in candidates
        ]
        self._taken = {(c.host, c.component) for c in here.contributions}
        self._init = frozenset(merge(here.contributions, here.host).init)

    def of(self, chosen: Chosen) -> Trial:
        """Try a set of candidates."""
        if chosen not in self._known:
            self._known[chosen] = self._tried(chosen)
        return self._known[chosen]

    def contributions(self, number: int) -> tuple[Contribution, ...]:
        """What a candidate brings; components that are here take precedence over it."""
        return self._contributions[number]

    def has_conflict(self, chosen: Chosen) -> bool:
        """Whether some of a set would be kept out of planning, or cannot be here together."""
        if chosen not in self._conflicts:
            is_double = self.without_doubles(chosen) != chosen
            self._conflicts[chosen] = is_double or bool(self.taken(chosen) or self.refused(chosen))
        return self._conflicts[chosen]

    def without_doubles(self, chosen: Chosen) -> Chosen:
        """Of candidates that bring the same component only the first."""
        kept: set[int] = set()
        components: set[str] = set()
        for number in sorted(chosen):
            brought = {c.component for c in self._contributions[number]}
            if brought.isdisjoint(components):
                kept.add(number)
                components |= brought
        return frozenset(kept)

    def taken(self, chosen: Chosen) -> Chosen:
        """The candidates that bring a component which is here already, from another release."""
        return frozenset(n for n in chosen for c in self._contributions[n] if self._is_taken(c))

    def refused(self, chosen: Chosen) -> Chosen:
        """The candidates of which something would be kept out of planning; no two of them may
        bring the same component."""
        merged = self._merged(chosen)
        return frozenset(
            number
            for number in chosen
            for contribution in self._contributions[number]
            if contribution.component in merged.quarantined
        )

    def sound(self, number: int) -> Candidate:
        """A candidate without what is here already, from another release of it, and without what
        would be kept out here; the caveats say why."""
        candidate = self.candidates[number]
        found = merge((*self._here.contributions, *self._free(number)), self._here.host)
        caveats: list[Problem] = []
        kept: list[Contribution] = []
        for contribution in candidate.contributions:
            if self._is_taken(contribution):
                continue
            if contribution.component in found.quarantined:
                caveats += found.quarantined[contribution.component]
            else:
                kept.append(contribution)
        return replace(candidate, contributions=tuple(kept), caveats=(*candidate.caveats, *caveats))

    def used(self, chosen: Chosen, trial: Trial) -> Chosen:
        """The candidates of a set that a trial's plan has to do with."""
        assert trial.task is not None, "there is a plan"
        assert trial.plan is not None, "there is a plan"
        assert trial.merged is not None, "there is a plan"
        owners = self._owners(chosen)
        steps = [trial.task.actions[index] for index in trial.plan.steps]
        found: set[int] = set()
        for step in steps:
            for name in step.arguments:
                found |= owners.get(name, set())
            found |= _owned_by(trial.merged.action(step.schema).origins, owners)
        facts = trial.task.goal.union(*(step.precondition for step in steps))
        for text in (trial.task.facts[index] for index in facts):
            for name in parts(text)[1]:
                found |= owners.get(name, set())
                thing = trial.merged.objects.get(name)
                found |= _owned_by(thing.origins if thing else (), owners)
            if text not in self._here.facts:
                found |= _owned_by(trial.merged.init.get(text, ()), owners)
        return frozenset(found)

    def _is_taken(self, contribution: Contribution) -> bool:
        return (contribution.host, contribution.component) in self._taken

    def _free(self, number: int) -> Iterator[Contribution]:
        return (c for c in self._contributions[number] if not self._is_taken(c))

    def _merged(self, chosen: Chosen) -> Merged:
        if chosen not in self._merges:
            brought = (c for number in sorted(chosen) for c in self._free(number))
            self._merges[chosen] = merge((*self._here.contributions, *brought), self._here.host)
        return self._merges[chosen]

    def _owners(self, chosen: Chosen) -> dict[str, set[int]]:
        """Objects, and components (after a space), with the candidates that own them."""
        owners: dict[str, set[int]] = {}
        for number in chosen:
            for contribution in self._contributions[number]:
                names = [unit.object for unit in contribution.units]
                names += [stream.object for stream in contribution.streams]
                for name in (*names, f" {contribution.component}"):
                    owners.setdefault(name, set()).add(number)
        return owners

    def _tried(self, chosen: Chosen) -> Trial:
        if self.has_conflict(chosen):
            return Trial(Outcome.CONFLICT)
        self.count += 1
        merged = self._merged(chosen)
        try:
            goal = parse_goal(self._goal, merged).expr
        except GoalRefused:
            return Trial(Outcome.IMPOSSIBLE, merged)
        try:
            task = ground(merged, self._facts(chosen, merged), goal)
        except TooManyBindings as refused:
            blamed = [self._owners(chosen).get(f" {name}", set()) for name in refused.components]
            oversized = dict.fromkeys(set[int]().union(*blamed), refused.problems[0])
            return Trial(Outcome.UNKNOWN, merged, goal, oversized=oversized)
        except FragmentRefused:
            return Trial(Outcome.UNKNOWN, merged, goal)
        kept = tuple(a for a in task.actions if a.name not in self._here.excluded)
        task = replace(task, actions=kept)
        answer = quick_answer(task) or self._search(task)
        match answer:
            case AlreadyTrue():
                return Trial(Outcome.POSSIBLE, merged, goal, task, Plan((), 0))
            case Plan() as plan if not validate(task, plan) and not cut_short(merged, task, plan):
                return Trial(Outcome.POSSIBLE, merged, goal, task, plan)
            case Unsolvable():
                return Trial(Outcome.IMPOSSIBLE, merged, goal, task)
        return Trial(Outcome.UNKNOWN, merged, goal, task)

    def _facts(self, chosen: Chosen, merged: Merged) -> frozenset[str]:
        """What would be believed: what is, and what the new ones and the host say of them."""
        facts = set(self._here.facts)
        brought: set[str] = set()
        for number in chosen:
            facts |= self.candidates[number].facts
            brought |= {c.component for c in self._contributions[number]}
        facts |= {text for text in merged.init if text not in self._init}
        facts.update(_said_by(merged, brought))
        return frozenset(facts)


def _owned_by(origins: Iterable[Origin], owners: Mapping[str, set[int]]) -> set[int]:
    """The candidates that say something which no component says that is here."""
    brought = [owners.get(f" {origin.component}", set()) for origin in origins]
    return set().union(*brought) if all(brought) else set()


def _said_by(merged: Merged, components: Iterable[str]) -> Iterator[str]:
    """The facts that some components' fragments say, whether or not others said so before."""
    wanted = frozenset(components)
    for text, origins in merged.init.items():
        if any(origin.component in wanted for origin in origins):
            yield text
