"""Steps of plans become behaviours of components, and their news becomes beliefs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeAlias

from nondum.host.core.events.behaviours import (
    BehaviourEnded,
    BehaviourEstablished,
    BehaviourProgressed,
)
from nondum.host.core.events.event import Event
from nondum.host.core.events.facts import FactForgotten, FactKnown
from nondum.host.core.events.workers import WorkerExited
from nondum.host.mind.beliefs import Beliefs
from nondum.host.mind.composition import Composition
from nondum.planning.execute.running import RunState
from nondum.planning.execute.step import Step
from nondum.planning.pddl.facts import parts
from nondum.sdk.errors import NondumError

FactValue: TypeAlias = tuple[str, tuple[str, ...], Any]
"""Predicate, arguments, and the value as it travels."""


class Call(Protocol):
    """A behaviour that was asked to run."""

    @property
    def id(self) -> int:
        """The `call_id` of its events; unique among its component's calls."""
        ...

    @property
    def state(self) -> RunState:
        """How far it is: it may have ended by the time that it is handed over."""
        ...

    @property
    def reason(self) -> str:
        """Why it failed or was halted."""
        ...

    def halt(self) -> None:
        """Ask it to end; bounded, whatever the plugin does. Returns at once."""
        ...


class Calls(Protocol):
    """What the mind needs of the workers. How a call goes on is told by events."""

    def behave(
        self,
        component: str,
        behaviour: str,
        arguments: Mapping[str, str],
        values: Sequence[FactValue],
    ) -> Call:
        """Ask a component for a behaviour, its streams wired as the arguments say. Returns at once.

        Raises `NondumError` where that cannot even be asked: PEER_DOWN if the component's host is
        gone, which a new composition without it will tell.
        """
        ...

    def tell_values(self, component: str, values: Sequence[FactValue]) -> None:
        """Tell a component new values of facts that its behaviours run on."""
        ...

    def claims(self, component: str) -> Iterable[Event]:
        """The news that a component told before it was in the catalogue, and that still hold."""
        ...


@dataclass(slots=True)
class RunningBehaviour:
    """A step that was started. Satisfies `running.RunningAction`."""

    step: Step
    component: str
    behaviour: str
    streams: tuple[str, ...] = ()
    """The streams that it reads and writes."""
    values: tuple[str, ...] = ()
    """The valued facts that it runs on."""
    state: RunState = RunState.STARTING
    reason: str = ""
    progress: str = ""
    """How far it says it is."""
    call: Call | None = field(default=None, repr=False)

    def halt(self) -> None:
        """Ask it to end."""
        if self.state.has_ended:
            return
        if self.call is not None:
            self.call.halt()
        else:
            self.state = RunState.HALTED


class BehaviourRunner:
    """Starts behaviours and follows them to their end. Implements `running.Runner`."""

    def __init__(self, calls: Calls, beliefs: Beliefs, now_s: Callable[[], float]) -> None:
        self._calls = calls
        self._beliefs = beliefs
        self._now_s = now_s
        self._composition: Composition | None = None
        self._running: dict[tuple[str, int], RunningBehaviour] = {}
        self._unreached: list[RunningBehaviour] = []
        """Those of a host that is gone, though the composition does not know it yet."""

    def __iter__(self) -> Iterator[RunningBehaviour]:
        """All that runs, in the order it was started."""
        return iter(tuple(self._running.values()))

    def adopt(self, composition: Composition) -> None:
        """From now on steps are read with this composition's words, and what could not reach its
        host is to be started again, if its host is there."""
        self._composition = composition
        for run in self._unreached:
            if not run.state.has_ended:
                run.state = RunState.FAILED
        self._unreached.clear()

    def start(self, step: Step) -> RunningBehaviour:
        """Ask the component that owns the actor for the behaviour of the step's action."""
        merged = self._composition.merged if self._composition else None
        try:
            if merged is None:
                raise KeyError(step.name)
            _, component = merged.owner(step.actor)
            action, arguments = merged.action(step.action.schema), merged.bound(step.action)
            streams, valued = merged.streams(step.action), merged.valued_facts(step.action)
        except KeyError as gone:
            reason = f"there is no {gone.args[0]} any more"
            return RunningBehaviour(step, "", "", state=RunState.FAILED, reason=reason)
        run = RunningBehaviour(step, component, action.behaviour, streams, valued)
        try:
            values = [self._valued(text) for text in valued]
            run.call = self._calls.behave(component, action.behaviour, arguments, values)
        except NondumError as error:
            run.reason = str(error)
            if error.code == "PEER_DOWN":  # to be pruned; no failure that the plan may be stuck by
                self._unreached.append(run)
            else:
                run.state = RunState.FAILED
            return run
        self._running[component, run.call.id] = run
        if run.call.state.has_ended:
            self._on_ended((component, run.call.id), run.call.state, run.call.reason)
        return run

    def on_event(self, event: Event) -> bool:
        """Take in news of a call. Says whether it was news of one."""
        match event:
            case BehaviourEstablished(component, _, call_id):
                return self._on_established(component, call_id)
            case BehaviourEnded(component, _, call_id, outcome, reason):
                return self._on_ended((component, call_id), RunState[outcome], reason)
            case BehaviourProgressed(component, _, call_id, fraction, text):
                if run := self._running.get((component, call_id)):
                    run.progress = f"{fraction:.0%} {text}".strip()
                return False
            case WorkerExited(component, reason):
                self._end_all(component, RunState.FAILED, reason)
                return True
            case FactKnown() | FactForgotten():
                self._pass_on(event.predicate)
        return False

    def lose(self, component: str) -> None:
        """A component is gone, or another release took its place: everything that it ran is over.
        That is no failure of the actions."""
        self._end_all(component, RunState.GONE, "its component is gone")

    def halt_all(self) -> None:
        """Ask everything to end."""
        for run in self:
            run.halt()

    def _end_all(self, component: str, state: RunState, reason: str) -> None:
        for key in [key for key in self._running if key[0] == component]:
            self._on_ended(key, state, reason)

    def _on_established(self, component: str, call_id: int) -> bool:
        run = self._running.get((component, call_id))
        if run is None or not run.step.lasting or run.state is not RunState.STARTING:
            return False
        run.state = RunState.ESTABLISHED
        self._beliefs.world.establish(
            run.step.name,
            component,
            add=run.step.add,
            delete=run.step.delete,
            at_s=self._now_s(),
        )
        return True

    def _on_ended(self, key: tuple[str, int], state: RunState, reason: str) -> bool:
        run = self._running.pop(key, None)
        if run is None:
            return False
        run.state, run.reason = state, reason
        self._beliefs.world.end(run.step.name)
        if state is RunState.SUCCEEDED and not run.step.lasting:
            self._beliefs.world.succeed(
                run.step.name,
                run.component,
                add=run.step.add,
                delete=run.step.delete,
                at_s=self._now_s(),
            )
        return True

    def _pass_on(self, predicate: str) -> None:
        """Tell running behaviours the new values of what they run on."""
        for run in self:
            values = [self._valued(f) for f in run.values if parts(f)[0] == predicate]
            if values:
                self._calls.tell_values(run.component, values)

    def _valued(self, text: str) -> FactValue:
        predicate, arguments = parts(text)
        return predicate, arguments, self._beliefs.world.value(text)
