"""Workers under test: plugins written as files, real processes, events collected."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import pluggy
from tests.kit.clock import VirtualClock
from tests.kit.processes import children
from tests.kit.until import PATIENCE_S, arrived, until_async

from nondum.host.config.confinement_level import ConfinementState, parse_wanted
from nondum.host.core.events.behaviours import BehaviourEnded
from nondum.host.core.events.event import Event
from nondum.host.core.events.workers import WorkerExited, WorkerReady
from nondum.host.workers import confinement_choice
from nondum.host.workers.call import Call
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.launcher import MARK, WorkerLauncher
from nondum.host.workers.spec import Limits, Timing, WorkerSpec, base_interpreter
from nondum.host.workers.workers import Workers
from nondum.sdk.description import Behaviour, Condition, Input, Output, PluginDescription, Unit
from nondum.wheelhouse.format.confinement import Level

SDK = Path(__file__).parents[2] / "plugins/sdk"
LIBRARIES = Path(pluggy.__file__).parents[1]
HOST = "rover"
TIMING = Timing(backoff_s=0.0)
"""As the product has it, but that workers are restarted at once."""

LEVEL = os.environ.get("NONDUM_TEST_LEVEL", "auto")
"""Level of confinement at which workers are tested; `auto`: the best of this machine."""

_E = TypeVar("_E", bound=Event)


@functools.cache
def confinement_state() -> ConfinementState:
    """How workers are tested."""
    return confinement_choice.confinement_state(parse_wanted(LEVEL), Level.NONE)


def level() -> Level:
    """The level at which workers are tested."""
    return confinement_state().level


@dataclass
class WorkersUnderTest:
    """Workers of one host, and all events that they emitted."""

    folder: Path
    timing: Timing = TIMING
    confinement: Confinement | None = None
    """What holds the workers; the machine's best, if not given."""
    events: list[Event] = field(default_factory=list)
    _others: frozenset[int] = field(default_factory=children)
    """Processes that were there before."""
    _arrived: asyncio.Event = field(default_factory=asyncio.Event)

    def __post_init__(self) -> None:
        if self.confinement is None:
            self.confinement = confinement_choice.confinement(
                confinement_state(), (self.folder, SDK, LIBRARIES)
            )
        launcher = WorkerLauncher(self.confinement)
        self.workers = Workers(HOST, self._on_event, launcher=launcher, timing=self.timing)

    def spec(
        self,
        component: str,
        source: str,
        *,
        behaviours: tuple[Behaviour, ...] = (),
        units: tuple[Unit, ...] = (),
        conditions: tuple[Condition, ...] = (),
        summary: str = "",
        limits: Limits | None = None,
        settings: dict[str, Any] | None = None,
    ) -> WorkerSpec:
        """Write a plugin of one module and say how to start it."""
        module = component.replace("-", "_") + "_plugin"
        site = self.folder / component / "site-packages"
        site.mkdir(parents=True)
        (site / f"{module}.py").write_text(source, encoding="utf-8")
        return WorkerSpec(
            component=component,
            payload="0" * 16,
            distribution=component,
            entry_point=module,
            site_packages=(site, SDK, LIBRARIES),
            python=base_interpreter(),
            scratch=self.folder / component / "scratch",
            index=PluginDescription(
                component,
                "0",
                summary=summary,
                behaviours=behaviours,
                conditions=conditions,
                units=units,
            ),
            settings=settings or {},
            limits=limits or Limits(),
        )

    async def start(self, component: str, source: str, **about: Any) -> WorkerSpec:
        """Write a plugin and start its worker."""
        spec = self.spec(component, source, **about)
        await self.workers.start(spec)
        return spec

    def behave(self, component: str, behaviour: str, **arguments: str) -> Call:
        """Ask for a behaviour; `u` is the component's unit of that name."""
        return self.workers.behave(component, behaviour, arguments)

    async def until(
        self,
        kind: type[_E],
        test: Callable[[_E], bool] = lambda _: True,
        timeout_s: float = PATIENCE_S,
    ) -> _E:
        """Wait for an event that has come, or comes."""
        return await arrived(
            kind.__name__,
            self._next(kind, test),
            evidence=lambda: "\n".join(map(str, self.events[-20:])),
            patience_s=timeout_s,
        )

    async def until_ready(self, times: int) -> None:
        """Wait until `times` starts of workers have succeeded."""
        await self.until(WorkerReady, lambda _: len(self.told(WorkerReady)) >= times)

    def told(self, kind: type[_E]) -> list[_E]:
        """All events of a kind, so far."""
        return [event for event in self.events if isinstance(event, kind)]

    def ends(self) -> list[tuple[str, str]]:
        """Behaviour and outcome of every call that ended, in order."""
        return [(event.behaviour, event.outcome) for event in self.told(BehaviourEnded)]

    def lines(self, component: str) -> list[str]:
        """What a component wrote and logged."""
        return [line.text for line in self.workers.logs.of(component)]

    def pid(self, component: str, told: str) -> int:
        """A process of a component's worker, as this host counts, by what its own `getpid()` is."""
        mark = f"{MARK}={self.folder / component / 'scratch'}".encode()
        for entry in Path("/proc").iterdir():
            with contextlib.suppress(OSError):
                if entry.name.isdigit() and mark in (entry / "environ").read_bytes():
                    status = (entry / "status").read_text(encoding="ascii")
                    (inner,) = re.findall(r"^NSpid:.*\s(\d+)$", status, re.MULTILINE)
                    if inner == told:
                        return int(entry.name)
        raise LookupError(f"{component} has no process {told}")

    async def close(self, clock: VirtualClock) -> None:
        """End all workers in virtual time; wait in real time until they are reaped: what a killed
        process is given may pass before the kernel has ended it."""
        await clock.advance_until(self.workers.close())
        await until_async(
            "ends of workers", lambda: not children() - self._others, evidence=self._left
        )

    def _left(self) -> str:
        return f"left: {sorted(children() - self._others)}"

    async def until_exited(self, times: int) -> None:
        """Wait until `times` workers have ended that were not to end."""
        await self.until(WorkerExited, lambda _: len(self.told(WorkerExited)) >= times)

    async def _next(self, kind: type[_E], test: Callable[[_E], bool]) -> _E:
        while True:
            for event in self.events:
                if isinstance(event, kind) and test(event):
                    return event
            self._arrived.clear()
            await self._arrived.wait()

    def _on_event(self, event: Event) -> None:
        self.events.append(event)
        self._arrived.set()


def camera(name: str = "camera", *, always: bool = False) -> Unit:
    """A unit with one image output, `frames`."""
    return Unit(name, "camera", outputs=(Output("frames", "image", always=always),))


def pose_reader(name: str = "reader") -> Unit:
    """A unit with an optional pose input, `odometry`."""
    return Unit(name, "sensor", inputs=(Input("odometry", "pose"),))


__all__ = [
    "HOST",
    "TIMING",
    "WorkersUnderTest",
    "camera",
    "pose_reader",
    "replace",
]
