"""The plan executive: decides what goes on, what is halted, what is started, and why.

It starts and halts nothing itself: it makes a `Run` of each action that is to run, and marks the
runs that are to end; the leaves of the task tree act. The same world at the same time gives the
same decision.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from enum import Enum

from nondum.planning.execute.attempts import Attempts, Patience, Setbacks
from nondum.planning.execute.change_filter import ChangeFilter
from nondum.planning.execute.guards import Footing, facts_after, footing, twins_in
from nondum.planning.execute.partial_order import GOAL
from nondum.planning.execute.regression import Regression, Rest, Stuck
from nondum.planning.execute.running import Run, RunState, World
from nondum.planning.execute.step import Step
from nondum.planning.merge.goal import GoalKind
from nondum.sdk.frozen import frozen

GOAL_REACHED = "the goal is reached"
NOT_NEEDED = "nothing that is left to do needs it"


class Phase(Enum):
    """Where a task is after a decision."""

    UNDER_WAY = "under way"
    """Something runs, or will as soon as it may."""
    HOLDING = "holding"
    """The goal holds and is kept so."""
    REACHED = "reached"
    """The goal holds, and everything was halted."""
    STUCK = "stuck"
    """The plan does not fit the world any more, or one of its actions keeps failing."""


@frozen
class Past:
    """A run that has ended."""

    state: RunState
    """How it ended."""
    started_s: float
    ended_s: float
    answer: str = ""
    """What it answered, if it succeeded."""


class PlanExecutive:
    """Carries a plan out by regression. One `decide` is one tick."""

    def __init__(
        self,
        regression: Regression,
        *,
        kind: GoalKind,
        exclusive: frozenset[str] = frozenset(),
        runs: Iterable[Run] = (),
        patience: Patience | None = None,
        setbacks: Setbacks | None = None,
    ) -> None:
        """`exclusive` are units that serve one behaviour at a time and move the body; `runs` are
        taken over from the task before; so is what `setbacks` remembers."""
        self.regression = regression
        self.kind = kind
        self.phase = Phase.UNDER_WAY
        self.rest = Rest((1 << len(regression.steps)) - 1)
        self.needs_replan: str | None = None
        self.exhausted: tuple[str, ...] = ()
        """Actions that were given up and should not be in the next plan."""
        self.runs: dict[str, Run] = {run.step.name: run for run in runs}
        self.attempts = Attempts(patience or Patience(), setbacks or Setbacks())
        self.past: dict[str, Past] = {}
        """The last run of each action that has ended while this task was carried out."""
        self.exclusive = exclusive
        self._places: dict[str, int] = {}
        """Action → the mask of its steps."""
        for index, step in enumerate(regression.steps):
            self._places[step.name] = self._places.get(step.name, 0) | 1 << index
        self.decisions = 0
        """How often the world asked for a new decision."""
        self._run_states: list[tuple[str, RunState, bool]] = []
        self._waiting: dict[int, str] = {}
        self._twins = twins_in(regression.goal, *(s.precondition | s.add for s in regression.steps))
        taken_over = (run.step for run in self.runs.values())
        self._attention = ChangeFilter((*regression.steps, *taken_over), regression.goal)
        self._is_supported = False

    def decide(self, world: World, now_s: float) -> Phase:
        """Look at the world, halt and start what that asks for, and say where the task is."""
        for run in self.runs.values():
            run.watch(now_s)
        if self._is_as_before(world, now_s):
            return self.phase
        self.decisions += 1
        self._collect(now_s)
        if self.phase is not Phase.REACHED:  # done is done, though what reached it is halted again
            self.phase = self._decide(self._attention.narrowed(world), now_s)
        self._run_states = self._states()
        self._attention.keep(world, self._established(), closely=not self._is_supported)
        return self.phase

    def _decide(self, world: World, now_s: float) -> Phase:
        ground = self._uphold(world)
        self.needs_replan, self.exhausted, self._waiting = None, (), {}
        rest = self.regression.rest(ground.facts)
        self._is_supported = isinstance(rest, Rest)
        if isinstance(rest, Stuck):
            rest = self._unlock(world, rest, now_s)
        if isinstance(rest, Stuck):
            return self._stay(ground, rest)
        return self._pursue(rest, ground, now_s)

    def _is_as_before(self, world: World, now_s: float) -> bool:
        """Whether nothing has changed since the last decision, and nothing waits for time."""
        return (
            self._run_states == self._states()
            and not self.attempts.is_anything_settling
            and not any(self._wants_a_look(run, now_s) for run in self.runs.values())
            and self._attention.is_as_before(world, self._established())
        )

    def _wants_a_look(self, run: Run, now_s: float) -> bool:
        """Whether a run has ended, or is waited for and time may be up."""
        is_over = run.action.state.has_ended or run.ineffective_s is not None
        return is_over or self.attempts.overdue(run, now_s) is not None

    def _established(self) -> list[str]:
        return [n for n, r in self.runs.items() if r.action.state is RunState.ESTABLISHED]

    def _states(self) -> list[tuple[str, RunState, bool]]:
        return [(name, run.action.state, run.is_halting) for name, run in self.runs.items()]

    def halt(self, because: str) -> None:
        """Ask everything to end."""
        for run in self.runs.values():
            run.halt(because)

    def release(self) -> tuple[Run, ...]:
        """Hand over what runs, so that another task can go on with it."""
        runs = tuple(self.runs.values())
        self.runs = {}
        return runs

    @property
    def answer(self) -> str:
        """What the plan's behaviours answered, in the order of its steps."""
        return " ".join(filter(None, (p.answer for n in self._places if (p := self.past.get(n)))))

    def places_of(self, names: Iterable[str]) -> int:
        """The mask of the steps with these actions."""
        mask = 0
        for name in names:
            mask |= self._places.get(name, 0)
        return mask

    def waits_for(self, index: int) -> str:
        """Why a step that could be next was not started at the last decision, or nothing."""
        return self._waiting.get(index, "")

    # What ended, and what lost its footing

    def _collect(self, now_s: float) -> None:
        for name, run in list(self.runs.items()):
            state = run.action.state
            if state is RunState.ESTABLISHED and run.established_s is None:
                run.established_s = now_s
            if state.has_ended:
                del self.runs[name]
                answer = run.action.reason if state is RunState.SUCCEEDED else ""
                self.past[name] = Past(state, run.started_s, now_s, answer)
                if not run.is_halting:
                    self._judge(run, state, now_s)
            elif problem := self.attempts.overdue(run, now_s):
                self.attempts.failed(name, str(problem))
                run.halt(str(problem))

    def _judge(self, run: Run, state: RunState, now_s: float) -> None:
        name, since_s = run.step.name, run.established_s
        if since_s is not None and now_s - since_s >= self.attempts.patience.steady_s:
            self.attempts.effective(name)
        if state is RunState.SUCCEEDED and not run.step.lasting:
            self.attempts.succeeded(name, now_s)
        elif state is not RunState.GONE:
            self.attempts.failed(name, run.action.reason or f"it {state.value} by itself")

    def _uphold(self, world: World) -> Footing:
        ground = footing(world, self.runs.values(), self._twins)
        for run, lacking in ground.fallen:
            run.halt(f"its guard is broken: {do_not_hold(lacking)}")
        return ground

    # When no rest of the plan is supported

    def _unlock(self, world: World, stuck: Stuck, now_s: float) -> Rest | Stuck:
        """Find runs that withhold what is missing, and halt them if the plan then goes on."""
        ended = {name for name, run in self.runs.items() if run.is_halting}
        blockers: set[str] = set()
        result: Rest | Stuck = stuck
        while isinstance(result, Stuck):
            more = {
                name
                for name, run in self.runs.items()
                if name not in blockers and not run.is_pending and run.step.delete & result.facts
            }
            if not more:
                return stuck
            blockers |= more
            result = self.regression.rest(facts_after(world, ended | blockers, self._twins))
        for run in (self.runs[name] for name in sorted(blockers - ended)):
            if self._is_out_of_patience(run, now_s):
                run.halt("it withholds what the plan needs next")
        return result

    def _is_out_of_patience(self, run: Run, now_s: float) -> bool:
        """Whether a run that does not do its part of the plan has had its time."""
        if run.step.name not in self._places:
            return True
        if run.ineffective_s is None:
            run.ineffective_s = now_s
        if now_s - run.ineffective_s < self.attempts.patience.settle_s:
            return False
        self.attempts.failed(run.step.name, "it runs, but its effects do not hold")
        return True

    def _stay(self, ground: Footing, stuck: Stuck) -> Phase:
        """Let what runs go on if its success would help; otherwise ask for another plan."""
        self.rest = Rest(stuck.steps)
        pending = [run for run in self.runs.values() if run.is_pending]
        gone = frozenset[str]().union(*(run.step.delete for run in pending))
        come = frozenset[str]().union(*(run.step.add for run in pending))
        if pending and isinstance(self.regression.rest(ground.facts - gone | come), Rest):
            return Phase.UNDER_WAY
        link = stuck.missing[0]
        needed = "the goal" if link.consumer == GOAL else self.regression.steps[link.consumer].name
        lacking = {other.fact for other in stuck.missing if other.consumer == link.consumer}
        return self._give_up(f"{do_not_hold(lacking)}, which {needed} needs")

    def _give_up(self, why: str) -> Phase:
        """Hold safely until there is another plan: nothing that moves the body goes on."""
        self.needs_replan = why
        for run in self.runs.values():
            if run.step.actor in self.exclusive:
                run.halt(f"the plan is stuck: {why}")
        return Phase.STUCK

    # When a rest of the plan is supported

    def _pursue(self, rest: Rest, ground: Footing, now_s: float) -> Phase:
        self.rest = rest
        for name in self.attempts.names():
            if not self._is_left(name) and not self._is_unproven(name, now_s):
                self.attempts.effective(name)
        for run in self.runs.values():
            if run.step.add <= ground.facts:
                run.ineffective_s = None
        if not rest.steps and self.kind != "maintain":
            self.halt(GOAL_REACHED)
            return Phase.REACHED
        self._halt_unneeded()
        if not rest.steps:
            return Phase.HOLDING
        return self._advance(rest, ground, now_s)

    def proven(self, now_s: float) -> tuple[str, ...]:
        """The lasting actions that have held long enough to count as working."""
        lasting = (name for name, run in self.runs.items() if run.step.lasting)
        return tuple(name for name in lasting if not self._is_unproven(name, now_s))

    def trouble(self) -> str:
        """Which action is tried again, and how it failed the last time; empty: none."""
        for name in self._places:
            failure = self.attempts.last_failure(name)
            if failure and self._is_left(name):
                return f"{name.partition(' ')[0]} is tried again; last time: {failure}"
        return ""

    def _is_unproven(self, name: str, now_s: float) -> bool:
        """Whether an action is a lasting one that has not held for a while yet: it may establish
        and fail again and again."""
        if not any(step.lasting for step in self.regression.steps if step.name == name):
            return name not in self._places
        since_s = self.runs[name].established_s if name in self.runs else None
        return since_s is None or now_s - since_s < self.attempts.patience.steady_s

    def _is_left(self, name: str) -> bool:
        """Whether an action is to be done, or done again."""
        return bool(self.places_of((name,)) & self.rest.steps)

    def _halt_unneeded(self) -> None:
        """Keep what the rest or a kept run needs, along causal links; halt all other runs."""
        kept: list[Run] = []
        others: list[Run] = []
        for name, run in self.runs.items():
            if not run.is_halting:
                (kept if self._is_left(name) else others).append(run)
        if not others:
            return
        needed = set(self.regression.needs(self.rest.steps)).union(*(r.step.guard for r in kept))
        while wanted := [r for r in others if r.is_established and r.step.add & needed]:
            for run in wanted:
                needed |= run.step.guard
                others.remove(run)
        for run in others:
            run.halt(NOT_NEEDED)

    def _advance(self, rest: Rest, ground: Footing, now_s: float) -> Phase:
        for index in self.regression.order.first_of(rest.steps):
            step = self.regression.steps[index]
            if step.name in self.runs:
                self._await(index, self.runs[step.name], now_s)
            elif self.attempts.is_settling(step.name, now_s):
                self._waiting[index] = "waits for its effects to be seen"
            elif self.attempts.given_up(step.name):
                self.exhausted += (step.name,)
            elif obstacle := self._obstacle(step, ground):
                self._waiting[index] = obstacle
            else:
                self.runs[step.name] = Run(step, now_s)
        if self.exhausted:
            reasons = (f"{n} {self.attempts.given_up(n)}" for n in self.exhausted)
            return self._give_up("; ".join(reasons))
        if self._may_change(now_s):
            return Phase.UNDER_WAY
        return self._give_up("; ".join(sorted(set(self._waiting.values()))))

    def _may_change(self, now_s: float) -> bool:
        """Whether something that this task started, halted or waits for can bring it further."""
        return any(self.attempts.is_settling(n, now_s) for n in self.attempts.names()) or any(
            run.is_pending
            or run.is_halting
            or run.ineffective_s is not None
            or run.action.state.has_ended  # as soon as it was started: judged next time
            for run in self.runs.values()
        )

    def _await(self, index: int, run: Run, now_s: float) -> None:
        if run.is_halting:
            self._waiting[index] = "waits until it has ended, to start again"
        elif run.is_established and self._is_out_of_patience(run, now_s):
            run.halt("it runs, but its effects do not hold")

    def _obstacle(self, step: Step, ground: Footing) -> str:
        """Why a step may not start yet, or nothing."""
        if lacking := step.precondition - ground.facts:
            return f"waits for {in_words(lacking)}"
        for run in self.runs.values():
            if step.actor == run.step.actor and step.actor in self.exclusive:
                return f"waits for {step.actor}, which {run.step.name} uses"
            if run.is_pending and interferes(step, run.step):
                return f"waits for {run.step.name} to end"
        return ""


def interferes(one: Step, other: Step) -> bool:
    """Whether two steps may not be under way at once: one takes what the other needs or gives."""
    return bool(
        one.delete & (other.precondition | other.add) or other.delete & (one.precondition | one.add)
    )


def in_words(facts: Collection[str]) -> str:
    """Facts as PDDL for people.

    >>> in_words({"ready cam"})
    '(ready cam)'
    """
    return ", ".join(f"({fact})" for fact in sorted(facts))


def do_not_hold(facts: Collection[str]) -> str:
    """The sentence that facts are not so.

    >>> do_not_hold({"ready cam"})
    '(ready cam) does not hold'
    """
    return f"{in_words(facts)} {'do' if len(facts) > 1 else 'does'} not hold"
