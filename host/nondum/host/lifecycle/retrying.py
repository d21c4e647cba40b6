"""A component that was given up is tried again once it has what it may have failed for."""

from __future__ import annotations

from dataclasses import replace

from nondum.host.core.effects import RestartWorker
from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.transitions import COMPONENT_TRANSITIONS
from nondum.host.lifecycle.turn import Turn


def try_again(turn: Turn, id: str, why: str) -> None:
    """Start a component again if it was given up; `why` is said after its name."""
    component = turn.state.components[id]
    state = COMPONENT_TRANSITIONS.get((component.state, RetryAsked))
    if state is not None:
        turn.put_component(replace(component, state=state, problems=()))
        turn.events.append(RetryAsked(component.payload, f"{id} {why}"))
        turn.effects.append(RestartWorker(id))
