"""Where each step of a task is, and why: what people are shown, read off a task's control.

Nothing is decided here.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum

from nondum.planning.execute.partial_order import GOAL, CausalLink
from nondum.planning.execute.plan_executive import PlanExecutive, in_words
from nondum.planning.execute.running import Run
from nondum.sdk.frozen import frozen


class StepState(Enum):
    """Where a step is."""

    DONE = "done"
    """It ran, and nothing that is left needs it to run again."""
    SKIPPED = "skipped"
    """It never ran: what the rest of the plan needs of it holds already."""
    RUNNING = "running"
    """It was started, and its effects are still to come."""
    KEPT = "kept"
    """A lasting one that is established, and kept running for what needs it."""
    HALTING = "halting"
    """It was asked to end and has not ended yet."""
    NEXT = "next"
    """Nothing that is left comes before it, and nothing is in its way."""
    WAITING = "waiting"
    """Something must be so before it may start."""
    EXCLUDED = "excluded"
    """It failed too often; the plan is stuck over it."""


@frozen
class StepStatus:
    """Where a step is, and why."""

    state: StepState
    why: str
    """In one sentence."""
    lacks: tuple[CausalLink, ...] = ()
    """For a step that is still to do: what it needs of steps that are still to do."""
    after: tuple[int, ...] = ()
    """Steps that are left and must come right before it."""
    needed_by: tuple[CausalLink, ...] = ()
    """What it gives, and who needs that."""
    takes: tuple[str, ...] = ()
    """Facts that do not hold any more once it has run; of a lasting one, while it runs."""
    exclusive: bool = False
    """Nothing else may use its unit meanwhile."""
    started_s: float | None = None
    ended_s: float | None = None
    """Of its last run; None while it runs."""


def step_status(control: PlanExecutive, index: int) -> StepStatus:
    """Look at one step of a task. Times are those that the task was ticked with."""
    step = control.regression.steps[index]
    state = _state(control, index)
    past, run = control.past.get(step.name), control.runs.get(step.name)
    left = control.rest.steps
    is_left = bool(left >> index & 1) and run is None
    needs = control.regression.needs_of(index) if is_left else ()
    earlier = control.regression.order.before[index] & left if is_left else 0
    return StepStatus(
        state,
        _why(control, index, state),
        lacks=tuple(n for n in needs if n.provider is not None and left >> n.provider & 1),
        after=tuple(control.regression.order.last_of(earlier)),
        needed_by=control.regression.uses_of(index),
        takes=tuple(sorted(step.delete)),
        exclusive=step.actor in control.exclusive,
        started_s=run.started_s if run else past.started_s if past else None,
        ended_s=past.ended_s if past and run is None else None,
    )


def _state(control: PlanExecutive, index: int) -> StepState:
    name = control.regression.steps[index].name
    if run := control.runs.get(name):
        return _running(run)
    if not control.rest.steps >> index & 1:
        return StepState.DONE if name in control.past else StepState.SKIPPED
    if name in control.exhausted:
        return StepState.EXCLUDED
    earlier = control.regression.order.before[index] & control.rest.steps
    is_held_up = earlier or control.waits_for(index) or control.needs_replan
    return StepState.WAITING if is_held_up else StepState.NEXT


def _running(run: Run) -> StepState:
    if run.is_halting:
        return StepState.HALTING
    return StepState.KEPT if run.is_established else StepState.RUNNING


def _why(control: PlanExecutive, index: int, state: StepState) -> str:
    step = control.regression.steps[index]
    match state:
        case StepState.HALTING:
            return f"being halted: {control.runs[step.name].halted_because}"
        case StepState.KEPT:
            return f"runs for {', '.join(_users(control, index)) or 'nothing'}"
        case StepState.RUNNING:
            doing = "is starting" if step.lasting else "is running"
            failure = control.attempts.last_failure(step.name)
            return f"{doing}; last time: {failure}" if failure else doing
        case StepState.DONE:
            return "done: what the rest of the plan needs of it holds"
        case StepState.SKIPPED:
            return "skipped: what the rest of the plan needs of it holds already"
        case StepState.EXCLUDED:
            return f"left out: it {control.attempts.given_up(step.name)}"
        case StepState.WAITING | StepState.NEXT:
            waits = control.waits_for(index) or _comes_after(control, index)
            failure = control.attempts.last_failure(step.name)
            return f"{waits}; last time: {failure}" if failure else waits


def _users(control: PlanExecutive, index: int) -> Iterator[str]:
    regression = control.regression
    consumers = dict.fromkeys(link.consumer for link in regression.uses_of(index))
    return ("the goal" if c == GOAL else regression.steps[c].name for c in consumers)


def _comes_after(control: PlanExecutive, index: int) -> str:
    regression = control.regression
    earlier = regression.order.before[index] & control.rest.steps
    if not earlier:
        stuck = control.needs_replan
        return f"the plan is stuck: {stuck}" if stuck else "is next: nothing left comes before it"
    lacking = {
        link.fact
        for link in regression.needs_of(index)
        if link.provider is not None and earlier >> link.provider & 1
    }
    names = ", ".join(regression.steps[i].name for i in regression.order.last_of(earlier))
    return f"comes after {names}" + (f", for {in_words(lacking)}" if lacking else "")
