"""What a starting daemon makes of the state that the last one left: back before STORED, else on.

The pure half is here; `folders.sweep` deletes what the recovered state does not account for.
"""

from __future__ import annotations

from dataclasses import replace

from nondum.host.catalogue.records import Moment, PayloadRecord, Step
from nondum.host.catalogue.state import HostState
from nondum.host.effects import SuspendPayload
from nondum.host.events import HostStarted, Recovered
from nondum.host.lifecycle.payload_rules import effect_for
from nondum.host.lifecycle.turn import Outcome, Turn
from nondum.host.transitions import RECOVERY
from nondum.sdk.errors import Problem

ATTEMPTS = 5
"""How often a payload is sent forward without becoming active before it is quarantined."""


def recover(state: HostState, at: Moment) -> Outcome:
    """Send every payload forward or back. Devices and drives are told anew by their sources."""
    turn = Turn(state, at)
    turn.change(devices={})
    for payload in state.payloads.values():
        turn.drop_components(payload.key)
        _recover(turn, payload)
    used = {name for payload in turn.state.payloads.values() for name in payload.sources}
    kept = {id: drive for id, drive in turn.state.drives.items() if id in used}
    turn.change(drives=kept, revision=state.revision + 1)
    recovered = tuple(event.payload for event in turn.events if isinstance(event, Recovered))
    turn.events.append(HostStarted(state.host, recovered))
    return turn.outcome()


def _recover(turn: Turn, payload: PayloadRecord) -> None:
    row = RECOVERY[payload.step]
    recovered = replace(payload, step=row.to, waits_for="")
    if row.to is Step.STORED:
        recovered = replace(recovered, attempts=payload.attempts + 1)
    if recovered.attempts > ATTEMPTS and row.to is Step.STORED:
        problem = Problem(
            "QUARANTINED",
            f"{ATTEMPTS} starts of the daemon in a row ended before it was active",
            where=payload.payload_id,
            fix="pull it and plug it in again, or ask for another try",
        )
        recovered = replace(recovered, step=Step.QUARANTINED, problems=(problem,))
        turn.effects.append(SuspendPayload(payload.key, payload.components))
    elif row.effect is not None:
        turn.effects.append(effect_for(row.effect, payload))
    turn.put_payload(recovered)
    if recovered.step is not payload.step or row.to is Step.REMOVING:
        turn.events.append(Recovered(payload.key, payload.step.name))
