"""A behaviour that was asked to run: how far it is, and how it is halted."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from nondum.host.core.events.behaviours import (
    BehaviourEnded,
    BehaviourEstablished,
    BehaviourStarted,
)
from nondum.host.core.events.event import Emit
from nondum.planning.execute.running import RunState


@dataclass(slots=True, eq=False)
class Call:
    """One run of one behaviour; satisfies planning's `RunningAction`."""

    id: int
    """Unique in the daemon's life."""
    component: str
    behaviour: str
    arguments: Mapping[str, str]
    """The action's parameters, without question marks → objects."""
    emit: Emit = field(repr=False)
    state: RunState = RunState.STARTING
    reason: str = ""
    """Why it failed or was halted; what it answered, if it succeeded; empty otherwise."""
    is_halting: bool = False
    """Whether it was asked to end."""
    _on_halt: Callable[[], None] | None = None
    _ended: asyncio.Event = field(default_factory=asyncio.Event)

    def __post_init__(self) -> None:
        self.emit(BehaviourStarted(self.component, self.behaviour, self.id, dict(self.arguments)))

    def halt(self) -> None:
        """Ask it to end. Returns at once; asking again is harmless."""
        if self.is_halting or self.state.has_ended:
            return
        self.is_halting = True
        if self._on_halt is not None:
            self._on_halt()

    async def ended(self) -> RunState:
        """Wait for its end."""
        await self._ended.wait()
        return self.state

    def when_halted(self, callback: Callable[[], None]) -> None:
        """Call back, once, as soon as it is asked to end."""
        self._on_halt = callback
        if self.is_halting:
            callback()

    def establish(self) -> None:
        """Its effects hold from now on."""
        if self.state is RunState.STARTING:
            self.state = RunState.ESTABLISHED
            self.emit(BehaviourEstablished(self.component, self.behaviour, self.id))

    def end(self, state: RunState, reason: str = "") -> None:
        """It has ended; ending twice is allowed and the first time counts."""
        if self.state.has_ended:
            return
        self.state, self.reason = state, reason
        self._ended.set()
        ended = BehaviourEnded(self.component, self.behaviour, self.id, state.name, reason)
        self.emit(ended)
