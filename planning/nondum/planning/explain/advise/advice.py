"""The question as one function: which payloads would help, and by which plan."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from nondum.planning.explain.advise.candidate import Candidate, Here
from nondum.planning.explain.advise.minimal import Enumeration
from nondum.planning.explain.advise.relevance import relevant
from nondum.planning.explain.advise.trial import Chosen, Outcome, Trial, Trials
from nondum.planning.explain.conflict import Search
from nondum.planning.merge.goal import read_goal
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import GroundTask, Plan

WAYS_LIMIT = 20
"""Alternatives that are told, at most."""
TRIALS_LIMIT = 300
"""Sets of payloads that are planned for, at most."""


@frozen
class Way:
    """Payloads, none of which can be spared, and the plan that they would give."""

    payloads: tuple[Candidate, ...]
    task: GroundTask
    plan: Plan

    @property
    def steps(self) -> tuple[str, ...]:
        """The names of the plan's actions."""
        return tuple(self.task.actions[index].name for index in self.plan.steps)


@frozen
class Advice:
    """What would make a goal possible."""

    now: Way | None
    """The plan with what is here already, where there is one: then nothing need be brought."""
    ways: tuple[Way, ...] = ()
    """All alternatives, those with the fewest payloads first, then the cheapest."""
    is_complete: bool = True
    """Whether these are all; if not, there may be more."""
    looked_at: int = 0
    """How many candidates may have to do with the goal."""
    unfit: tuple[Candidate, ...] = ()
    """Candidates of which nothing could be planned with here; their caveats say why."""

    @property
    def helps(self) -> bool:
        """Whether the goal is possible now, or would be."""
        return self.now is not None or bool(self.ways)


def advise(
    here: Here,
    goal: str,
    candidates: Iterable[Candidate],
    search: Search,
    *,
    ways_limit: int = WAYS_LIMIT,
    trials_limit: int = TRIALS_LIMIT,
) -> Advice:
    """Find all smallest sets of candidates with which there is a plan for a goal in PDDL.

    Every set was really merged, grounded, planned for with `search` and checked. A component that
    planning would keep out here helps in no set; of two payloads that contradict each other, or
    bring the same component, no set has both. The goal's words may come with a candidate. Raises
    `GoalRefused` for what is no condition.
    """
    now = Trials(here, goal, (), search).of(frozenset())
    if now.outcome is Outcome.POSSIBLE:
        return Advice(_way((), now))
    known = relevant(here.contributions, read_goal(goal), tuple(candidates))
    fit, unfit = _sifted(here, goal, known, search)
    trials = Trials(here, goal, fit, search)
    sets = Enumeration(trials, ways_limit, trials_limit)
    sets.run()
    ways = [_way(_picked(fit, chosen), trials.of(chosen)) for chosen in sets.found]
    ways.sort(key=lambda way: (len(way.payloads), way.plan.cost, _names(way)))
    for number, problem in sorted(sets.oversized.items()):
        unfit.append(replace(fit[number], caveats=(*fit[number].caveats, problem)))
    return Advice(None, tuple(ways), sets.is_complete, len(known), tuple(unfit))


def _sifted(
    here: Here, goal: str, candidates: Sequence[Candidate], search: Search
) -> tuple[list[Candidate], list[Candidate]]:
    """The candidates without what planning would keep out here, and those of which nothing is left.

    What is kept out beside others is looked at by itself, for it may be the others' fault.
    """
    trials = Trials(here, goal, candidates, search)
    suspects: set[int] = set()
    left = frozenset(range(len(candidates)))
    while left:
        group = trials.without_doubles(left)
        suspects |= trials.refused(group) | trials.taken(group)
        left -= group
    fit: list[Candidate] = []
    unfit: list[Candidate] = []
    for number, candidate in enumerate(candidates):
        sound = trials.sound(number) if number in suspects else candidate
        if sound.contributions:
            fit.append(sound)
        elif sound.caveats:  # else all of it is here, from another release
            unfit.append(sound)
    return fit, unfit


def _way(payloads: tuple[Candidate, ...], trial: Trial) -> Way:
    assert trial.task is not None, "there is a plan"
    assert trial.plan is not None, "there is a plan"
    return Way(payloads, trial.task, trial.plan)


def _picked(candidates: Sequence[Candidate], chosen: Chosen) -> tuple[Candidate, ...]:
    return tuple(candidates[number] for number in sorted(chosen))


def _names(way: Way) -> tuple[str, ...]:
    return tuple(candidate.name for candidate in way.payloads)
