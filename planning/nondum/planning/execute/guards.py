"""What holds once everything that lost its footing has gone: over-all guards, to a fixpoint.

A lasting behaviour stands on facts, some of which are effects of other lasting behaviours. Support
is counted from the ground up, so a pulled camera takes detector, tracker and drive down at once,
and behaviours that only hold each other up fall.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable

from nondum.planning.execute.running import Run, RunState, World
from nondum.planning.pddl.facts import is_twin, twin
from nondum.sdk.frozen import frozen


@frozen
class Footing:
    """What can be counted on at one moment."""

    facts: frozenset[str]
    """What holds by itself or through a run that stands. What a halting run deleted is not back
    before it has ended."""
    fallen: tuple[tuple[Run, frozenset[str]], ...]
    """Runs whose guard is broken, and the facts that each lacks."""


def footing(world: World, runs: Iterable[Run], twins: frozenset[str]) -> Footing:
    """Find which runs stand, and on what."""
    runs = tuple(runs)
    established = [run for run in runs if run.action.state is RunState.ESTABLISHED]
    bare = world.facts_without([run.step.name for run in established])
    seen = closed(world.facts, twins)
    facts = set(seen & closed(world.facts | bare, twins) & closed(bare, twins))
    waiting = [run for run in established if not run.is_halting]
    while standing := [run for run in waiting if run.step.guard <= facts]:
        for run in standing:
            facts |= run.step.add & seen
            waiting.remove(run)
    pending = [run for run in runs if run.is_pending and not run.step.guard <= facts]
    fallen = tuple((run, run.step.guard - facts) for run in (*waiting, *pending))
    return Footing(frozenset(facts), fallen)


def facts_after(world: World, ended: Collection[str], twins: frozenset[str]) -> frozenset[str]:
    """What would hold if these lasting behaviours had ended, twins included."""
    return closed(world.facts_without(ended), twins)


def closed(facts: frozenset[str], twins: frozenset[str]) -> frozenset[str]:
    """Add the twins that are true because what they deny does not hold."""
    return facts | {fact for fact in twins if twin(fact) not in facts} if twins else facts


def twins_in(*groups: Iterable[str]) -> frozenset[str]:
    """The twins among some facts."""
    return frozenset(fact for group in groups for fact in group if is_twin(fact))
