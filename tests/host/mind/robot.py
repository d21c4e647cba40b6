"""A robot for a mind: components that come and go, and behaviours that do as they are told."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from typing import Any

from tests.kit.until import arrived

from nondum.host.core.events.behaviours import BehaviourEnded, BehaviourEstablished
from nondum.host.core.events.event import Event
from nondum.host.core.events.facts import FactForgotten, FactKnown, StreamFlowing
from nondum.host.core.records.component import ComponentRecord, ComponentState
from nondum.host.core.records.mount import MountPose
from nondum.host.core.records.payload import FormerPayload
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.mind.frames import mounts_of_all
from nondum.host.mind.mind import Mind
from nondum.host.mind.mounts import MountUpdates
from nondum.host.mind.planners import Planners
from nondum.host.mind.runner import FactValue
from nondum.host.mind.system_tree import SystemTree, default_tree
from nondum.planning.execute.attempts import Patience
from nondum.planning.execute.running import RunState
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import HostUnreachable, Problem

HOST = "rover"
DEADLINE_S = 1e6
"""Of a search for a plan: its process is real, and the time of many of these tests is not."""


def _clock() -> Callable[[], float]:
    """The loop's, which may be virtual; any where there is none, for one tick."""
    try:
        return asyncio.get_running_loop().time
    except RuntimeError:
        return time.monotonic


@dataclass(eq=False)
class RobotCall:
    """One behaviour that was asked for."""

    robot: Robot
    id: int
    component: str
    behaviour: str
    arguments: Mapping[str, str]
    values: tuple[FactValue, ...]
    state: RunState = RunState.STARTING
    reason: str = ""
    is_to_halt: bool = False
    """Whether it was asked to halt."""

    def halt(self) -> None:
        self.is_to_halt = True
        asyncio.get_running_loop().call_soon(self.end, RunState.HALTED)

    def establish(self) -> None:
        if self.state is RunState.STARTING:
            self.state = RunState.ESTABLISHED
            self.robot.mind.on_event(BehaviourEstablished(self.component, self.behaviour, self.id))

    def end(self, state: RunState, reason: str = "") -> None:
        if not self.state.has_ended:
            self.state, self.reason = state, reason
            ended = BehaviourEnded(self.component, self.behaviour, self.id, state.name, reason)
            self.robot.mind.on_event(ended)


@dataclass(eq=False)
class Robot:
    """Components, their calls, and the mind that makes them. Implements `Calls`."""

    planners: Planners
    system_tree: SystemTree = default_tree
    components: dict[str, ComponentRecord] = field(default_factory=dict)
    mounts: tuple[MountPose, ...] = ()
    former: dict[str, FormerPayload] = field(default_factory=dict)
    calls: list[RobotCall] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    told_values: list[tuple[str, FactValue]] = field(default_factory=list)
    stubborn: set[str] = field(default_factory=set)
    """Behaviours, of all components or of one, that never get anywhere."""
    broken: set[str] = field(default_factory=set)
    """Components whose behaviours fail."""
    flapping: set[str] = field(default_factory=set)
    """Components whose behaviours are established, and fail half a second later."""
    unreachable: set[str] = field(default_factory=set)
    """Components whose host has just gone."""
    answers: dict[str, str] = field(default_factory=dict)
    """Behaviour of a component → what it answers when it succeeds."""
    early_news: dict[str, list[Event]] = field(default_factory=dict)
    """What components say before they are in the catalogue."""
    patience: Patience | None = None
    revision: int = 0
    told_mounts: list[Mapping[str, Any]] = field(default_factory=list)
    """What workers were told of where units sit."""
    on_mounts: Callable[[Mapping[str, Any]], None] = lambda mounts: None
    """Called with each mount update that workers get."""
    mind: Mind = field(init=False)

    def __post_init__(self) -> None:
        self._ids = count(1)
        self.mind = Mind(
            HOST,
            self,
            self.planners,
            emit=self.events.append,
            deadline_s=DEADLINE_S,
            patience=self.patience,
            system_tree=self.system_tree,
            now_s=_clock(),
        )
        self._mounts = MountUpdates(self._remount, self.mind.after_tick)
        self.see()

    # Calls

    def behave(
        self,
        component: str,
        behaviour: str,
        arguments: Mapping[str, str],
        values: Sequence[FactValue],
    ) -> RobotCall:
        if component in self.unreachable:
            raise HostUnreachable(Problem("PEER_DOWN", "there is no link to the peer"))
        call = RobotCall(self, next(self._ids), component, behaviour, arguments, tuple(values))
        self.calls.append(call)
        declared = self.components[component].description.behaviours
        lasting = next(b.lasting for b in declared if b.name == behaviour)
        loop = asyncio.get_running_loop()
        if component in self.broken:
            loop.call_soon(call.end, RunState.FAILED, "no light")
        elif component in self.flapping:
            loop.call_soon(call.establish)
            loop.call_later(0.5, call.end, RunState.FAILED, "no memory (eye/plugin.py:9)")
        elif self.stubborn & {behaviour, f"{component}.{behaviour}"}:
            pass
        elif lasting:
            loop.call_soon(call.establish)
        else:
            answer = self.answers.get(f"{component}.{behaviour}", "")
            loop.call_soon(call.end, RunState.SUCCEEDED, answer)
        return call

    def tell_values(self, component: str, values: Sequence[FactValue]) -> None:
        self.told_values += [(component, value) for value in values]

    def claims(self, component: str) -> Iterable[Event]:
        return self.early_news.get(component, ())

    # Recomposition

    def plug(self, *plugins: PluginDescription) -> None:
        for plugin in plugins:
            self.former.pop(plugin.name, None)
            self.components[plugin.name] = ComponentRecord(
                id=plugin.name,
                payload=f"key-{plugin.name}",
                payload_id=f"org.example.{plugin.name}",
                distribution=plugin.name,
                entry_point=plugin.name,
                version=plugin.version,
                state=ComponentState.READY,
                description=plugin,
                venv=Path("venv"),
                site_packages=Path("venv/lib"),
                scratch=Path("scratch"),
                rank=len(self.components),
            )
        self.see()

    def unplug(self, *names: str) -> None:
        for name in names:
            left = self.components.pop(name)
            self.former[name] = FormerPayload(
                left.payload_id, left.version, {name: left.description}, time.time(), 0
            )
        self.see()
        for call in self.calls:
            if call.component in names:
                call.end(RunState.HALTED, "its component is gone")

    def set_state(self, name: str, state: ComponentState) -> None:
        self.components[name] = replace(self.components[name], state=state)
        self.see()

    def see(self) -> None:
        self.revision += 1
        snapshot = Snapshot(
            HOST,
            self.revision,
            tuple(self.components.values()),
            mounts=self.mounts,
            former=tuple(self.former.values()),
        )
        self._mounts.see(mounts_of_all(snapshot))
        self.mind.see(snapshot)

    def _remount(self, mounts: Mapping[str, Any]) -> None:
        self.told_mounts.append(mounts)
        self.on_mounts(mounts)

    # News

    def know(self, component: str, predicate: str, *arguments: str, value: Any = None) -> None:
        self.mind.on_event(FactKnown(component, predicate, arguments, value))

    def forget(self, component: str, predicate: str, *arguments: str) -> None:
        self.mind.on_event(FactForgotten(component, predicate, arguments))

    def flow(self, component: str, slot: str, *, flowing: bool) -> None:
        self.mind.on_event(StreamFlowing(component, f"{HOST}__{component}__{slot}", flowing))

    # Looking

    async def until(self, holds: Callable[[], bool]) -> None:
        """Wait, while the mind runs, until something is so."""

        async def held() -> None:
            while not holds():
                await self.mind.changed(self.mind.version)

        await arrived("what is waited for", held(), evidence=lambda: self.told)

    async def until_goal(self, state: str, id: str = "1") -> None:
        await self.until(lambda: self.mind.queue[id].state.value == state)

    async def until_holding(self, id: str = "1") -> None:
        await self.until(lambda: self.holds(id))

    def holds(self, id: str) -> bool:
        """Whether a goal is kept so now."""
        rows = (row for row in self.mind.views.given() if row["id"] == id)
        return any(row["holds"] and row["state"] == "active" for row in rows)

    @property
    def running(self) -> set[str]:
        return {f"{c.component}.{c.behaviour}" for c in self.calls if not c.state.has_ended}

    @property
    def started(self) -> list[str]:
        return [f"{call.component}.{call.behaviour}" for call in self.calls]

    @property
    def told(self) -> list[str]:
        return [told.text for told in self.mind.people]

    def call(self, behaviour: str) -> RobotCall:
        """The last call of a behaviour."""
        return next(call for call in reversed(self.calls) if call.behaviour == behaviour)
