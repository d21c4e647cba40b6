"""`python -m benchmarks.composition` writes docs/benchmarks/composition.md."""

from __future__ import annotations

import argparse
import gc
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NoReturn, TypeVar

from benchmarks.composition import peer
from benchmarks.composition.strangers import HOST, stranger, text_bytes
from benchmarks.measuring import Spread, machine, ratio, table, write

from nondum.planning.execute.replay import replayed
from nondum.planning.execute.running import RunningAction, RunningLeaves
from nondum.planning.execute.step import Step
from nondum.planning.execute.task_tree import TaskTree
from nondum.planning.execute.world import WorldModel
from nondum.planning.ground.ground import ground
from nondum.planning.ground.pddl_text import pddl_text
from nondum.planning.ground.pricing import at_own_cost, handicaps, priced
from nondum.planning.merge.claims import claims_of
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.goal import parse_goal
from nondum.planning.merge.merge import merge
from nondum.planning.search import solve
from nondum.planning.search.validate import validate
from nondum.planning.words.phrases import phrasebook
from nondum.sdk.planner import GroundTask, Plan

PRESENT = 50
GOAL = "(following self person)"
PHASES = ("parse and check", "merge", "phrases", "ground", "plan", "tree")

_T = TypeVar("_T")


@dataclass
class Watch:
    """Milliseconds of processor time by phase."""

    phases_ms: dict[str, float] = field(default_factory=dict)

    def take(self, phase: str, work: Callable[[], _T]) -> _T:
        """Do some work, and take its time."""
        began = time.process_time()
        result = work()
        spent_ms = (time.process_time() - began) * 1000
        self.phases_ms[phase] = self.phases_ms.get(phase, 0.0) + spent_ms
        return result

    @property
    def total_ms(self) -> float:
        """All phases together."""
        return sum(self.phases_ms.values())


@dataclass(frozen=True)
class Round:
    """One set of strangers, from their fragments to a tree, and then one more of them."""

    first: Watch
    more: Watch
    steps: int
    ground_actions: int
    peer_ms: float


class NoRunner:
    """A runner for trees that are built and never ticked."""

    def start(self, step: Step) -> RunningAction:
        """Refuse."""
        return _refuse(step)


def _refuse(step: Step) -> NoReturn:
    raise AssertionError(f"{step.name} was started")


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=15)
    repeats = parser.parse_args().repeats
    composed(Watch(), [stranger(number, 0) for number in range(10)])  # imports, and the grammar
    rounds = [one_round(batch) for batch in range(1, repeats + 1)]
    write("composition", page(rounds))


def one_round(batch: int) -> Round:
    """Fifty plugins that no parser has read yet, and a fifty-first."""
    present = [stranger(number, batch) for number in range(PRESENT)]
    gc.collect()
    first, more = Watch(), Watch()
    merged, facts, made = composed(first, present)
    goal = parse_goal(GOAL, merged)
    task = ground(merged, facts, goal.expr)
    whole = [*present, stranger(PRESENT + 1, batch)]  # a detector: the goal can be reached with it
    composed(more, whole, running=made)
    text = pddl_text(merged, facts, goal.expr)
    peer_ms = peer.ground_ms(text.domain, text.problem)
    return Round(first, more, len(made), len(task.actions), peer_ms)


def composed(
    watch: Watch, present: Sequence[Contribution], *, running: Sequence[str] = ()
) -> tuple[Merged, frozenset[str], tuple[str, ...]]:
    """What a host does when its components have changed, up to a tree that could be ticked.

    The steps of a plan that is `running` are tried out in the new task; without one, it searches.
    """
    for contribution in present:
        claims = watch.take("parse and check", partial(claims_of, contribution))
        assert not claims.problems, claims.problems
    merged = watch.take("merge", lambda: merge(present, HOST))
    watch.take("phrases", lambda: phrasebook(present, merged))
    assert not merged.quarantined, merged.quarantined
    goal = parse_goal(GOAL, merged)
    bodies = (fact for contribution in present for fact in contribution.body_facts())
    facts = frozenset((f"self {HOST}", *merged.init, *bodies))
    task = watch.take("ground", lambda: ground(merged, facts, goal.expr))
    plan = watch.take(
        "plan", lambda: again(merged, facts, task, running) if running else searched(present, task)
    )
    assert not validate(task, plan)
    watch.take(
        "tree",
        lambda: TaskTree(
            task,
            plan,
            lasting=merged.lasting(),
            leaves=RunningLeaves(NoRunner(), time.monotonic),
            kind=goal.kind,
            sight=lambda: (WorldModel(), 0.0),
        ),
    )
    return merged, facts, tuple(task.actions[step].name for step in plan.steps)


def searched(present: Sequence[Contribution], task: GroundTask) -> Plan:
    """A plan of nondum's own planner."""
    answer = solve(priced(task, handicaps(present, HOST)), lambda: False)
    assert isinstance(answer, Plan), answer
    return at_own_cost(task, answer)


def again(merged: Merged, facts: frozenset[str], task: GroundTask, running: Sequence[str]) -> Plan:
    """The plan that runs, if it still reaches its goal."""
    plan = replayed(task, running, facts, merged.lasting())
    assert plan is not None
    return plan


def page(rounds: Sequence[Round]) -> str:
    """The page of docs/benchmarks."""
    written = sum(text_bytes(stranger(number, 1)) for number in range(PRESENT))
    first = Spread(tuple(r.first.total_ms for r in rounds))
    more = Spread(tuple(r.more.total_ms for r in rounds))
    theirs = Spread(tuple(r.peer_ms for r in rounds))
    front = Spread(
        tuple(sum(r.first.phases_ms[p] for p in ("parse and check", "ground")) for r in rounds)
    )
    rows = [
        [
            phase,
            f"{Spread(tuple(r.first.phases_ms[phase] for r in rounds)):.1f}",
            f"{Spread(tuple(r.more.phases_ms[phase] for r in rounds)):.1f}",
        ]
        for phase in PHASES
    ]
    rows.append(["merge, ground, plan", *(f"{spread:.1f}" for spread in _planned(rounds))])
    rows.append(["all", f"{first:.1f}", f"{more:.1f}"])
    header = ["", f"{PRESENT} strangers: ms", "one more: ms"]
    return f"""# From fragments to a running plan

`python -m benchmarks.composition` wrote this page. {PRESENT} plugins whose authors share the
core's words and nothing else ({written / 1024:.0f} KiB of PDDL: cameras, detectors of several
costs, trackers, bases, surveyors, arms, probes, pointers, speakers, lamps; with types, constants,
functions, `or`, `forall`, `when`, derived predicates), then a fifty-first that the goal can be
reached with. No text was seen before it is measured. The plan ({rounds[0].steps} steps, of
{rounds[0].ground_actions} ground actions) is validated. Processor time in one process;
{len(rounds)} repeats, medians (lowest-highest).

{table(header, rows)}

One more costs {ratio(more, first)} of all {PRESENT}: what was parsed, checked and prepared is
kept; merging and grounding are done again, and the plan that runs is tried out in the new task.

For comparison, Fast Downward's translator (Python, too) reads and grounds the merged domain and
problem in {theirs:.0f} ms; nondum's parse, check and ground take {ratio(front, theirs)} of that.

Machine: {machine()}.
"""


def _planned(rounds: Sequence[Round]) -> tuple[Spread, Spread]:
    """What it takes once the texts are read."""
    first, more = ([getattr(r, which).phases_ms for r in rounds] for which in ("first", "more"))
    return (_sums(first), _sums(more))


def _sums(phases: Sequence[Mapping[str, float]]) -> Spread:
    return Spread(tuple(one["merge"] + one["ground"] + one["plan"] for one in phases))


if __name__ == "__main__":
    main()
